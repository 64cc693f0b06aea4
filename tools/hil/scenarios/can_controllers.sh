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
start_playing 100
start_daemon --set can.enabled=true --set can.interface=can0 --set can.rate_hz=50
wait_until 20 "the stream" says "streams GREY"
go
wait_until 20 "poses" says "-> tracking"
candump -L can1 > /tmp/can.log &
dump=$!
wait $player || fail "the frames could not be played"
kill $dump
stop_daemon
refused=$(grep -o '[0-9]* CAN frames were not sent' $daemon_log | cut -d' ' -f1)
[ -n "$BROKEN" ] || [ "${refused:-0}" = 0 ] || fail "$refused CAN frames were not sent"
cp /tmp/played /tmp/can.log "$left"
