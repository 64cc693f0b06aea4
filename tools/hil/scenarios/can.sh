# Odometry at 50 Hz on vcan from images at 10 Hz, read by a receiver that knows only the DBC: rate, counter, CRC, age.
#@ form: short
#@ check: bus can.log played 50 valid
#@ broken: one epoch is taken out of what the receiver gets
#@ broken_says: ^counter|frames of the epoch
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"
start_playing 100
start_daemon --set can.enabled=true --set can.interface=vcan0 --set can.rate_hz=50
wait_until 20 "the stream" says "streams GREY"
go
wait_until 20 "poses" says "-> tracking"
candump -L vcan0 > /tmp/can.log &
dump=$!
wait $player || fail "the frames could not be played"
kill $dump
stop_daemon
cp /tmp/played /tmp/can.log "$left"
[ -z "$BROKEN" ] || sed -i '101,108d' "$left/can.log"
