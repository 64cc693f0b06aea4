# The same odometry in CAN FD's frames at 50 Hz, on a vcan of their size.
#@ form: long
#@ check: bus can.log played 50 valid fd
#@ broken: the frames are classic ones
#@ broken_says: ^a classic frame
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 mtu 72 type vcan && ip link set up vcan0 || fail "no vcan0"
start_playing 100
fd=true
[ -z "$BROKEN" ] || fd=false
start_daemon --set can.enabled=true --set can.interface=vcan0 --set can.rate_hz=50 --set can.fd=$fd
wait_until 20 "the stream" says "streams GREY"
go
wait_until 20 "poses" says "-> tracking"
candump -L vcan0 > /tmp/can.log &
dump=$!
wait $player || fail "the frames could not be played"
kill $dump
stop_daemon
cp /tmp/played /tmp/can.log "$left"
