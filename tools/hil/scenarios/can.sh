# SPDX-License-Identifier: Apache-2.0
# Odometry at 50 Hz on vcan from images at 10 Hz, decoded by the DBC alone: rate, counter, CRC, age.
#@ form: short
#@ check: bus can.log played 50 valid
#@ broken: one epoch is taken out of what the receiver gets
#@ broken_says: ^counter|frames of the epoch
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"
carry_odometry vcan0 vcan0
[ -z "$BROKEN" ] || sed -i '101,112d' "$left/can.log"
