# SPDX-License-Identifier: Apache-2.0
# The same odometry at 50 Hz, an epoch in one CAN FD frame, on a vcan of its size.
#@ form: long
#@ check: bus can.log played 50 valid fd
#@ broken: the frames are classic ones
#@ broken_says: is not in the DBC
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 mtu 72 type vcan && ip link set up vcan0 || fail "no vcan0"
/tmp/farpoint dbc --set can.fd=true -o "$left/mine.dbc" || fail "no DBC of CAN FD's frame"
fd=true
[ -z "$BROKEN" ] || fd=false
carry_odometry vcan0 vcan0 --set can.fd=$fd
