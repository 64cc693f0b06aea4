# Two busy loops a core at normal priority: with real-time priority no frame is dropped and the bus keeps its rate.
#@ form: short
#@ check: images run.lcm played
#@ check: status out.lcm frames_dropped=0..0 times_backwards=0..0 camera_losses=0..0
#@ check: bus can.log played 50
#@ broken: the loops have a higher real-time priority than the daemon
#@ broken_says: .
loopback
modprobe -a vcan can-raw && ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan"
start_playing 100
start_daemon --record /tmp/run.lcm --output /tmp/out.lcm --set camera.stall_s=30 --set can.enabled=true \
  --set can.interface=vcan0 --set can.rate_hz=50 --set realtime.capture_priority=40 --set realtime.output_priority=35 \
  --set realtime.tracking_priority=30
wait_until 20 "the stream" says "streams GREY"
says "fp-tracking SCHED_FIFO 30" || fail "no real-time priority: $(grep "real time" $daemon_log)"
hogs=
for _ in 1 2 3 4; do
  ${BROKEN:+chrt -f 90} sh -c 'while :; do :; done' &
  hogs="$hogs $!"
done
chrt -f -p 95 $player  # the camera is hardware
go
sleep 3
chrt -f 96 candump -L vcan0 > /tmp/can.log &
dump=$!
wait $player || fail "the frames could not be played"
kill $dump $hogs
stop_daemon
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/can.log
