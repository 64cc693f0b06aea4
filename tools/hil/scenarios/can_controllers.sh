# SPDX-License-Identifier: Apache-2.0
# Odometry at 50 Hz through the kernel's driver of one emulated SJA1000 controller, read from another on the same bus.
#@ form: long
#@ devices: -object can-bus,id=bus0 -device kvaser_pci,canbus=bus0 -device kvaser_pci,canbus=bus0
#@ check: bus can.log played 50 valid
#@ broken: the receiving controller stays down
#@ broken_says: ^only 0 epochs came
loopback
modprobe -a kvaser_pci can-raw || fail "no SJA1000 driver"
for bus in can0 can1; do
  ip link set $bus type can bitrate 500000 restart-ms 100 berr-reporting on || fail "$bus takes no bit rate"
done
ip link set can0 up || fail "can0 does not come up"
[ -n "$BROKEN" ] || ip link set can1 up || fail "can1 does not come up"
carry_odometry can0 can1
[ -n "$BROKEN" ] || [ "$(not_sent)" = 0 ] || fail "$(not_sent) CAN frames were not sent"
