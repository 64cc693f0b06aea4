# A camera that stops without an error: no_camera within lost_after_s, started anew, and tracked again when it goes on.
#@ form: short
#@ check: status out.lcm frames_dropped=0..0 times_backwards=0..0 camera_losses=1..20
#@ broken: it does not stop
#@ broken_says: ^no_camera is said: not within
loopback
start_playing 200
start_daemon --output /tmp/out.lcm
wait_until 20 "the stream" says "streams GREY"
go
wait_until 30 "tracking" says "-> tracking"
so_far=$(said "-> no_camera")
[ -n "$BROKEN" ] || kill -STOP $player
from=$(seconds)
wait_until 3 "no_camera is said" said_times "-> no_camera" $((so_far + 1))
figure "no_camera after $(since "$from") s"
sleep 3
says "no image came, the stream is started anew" || fail "the stream is not started anew"
so_far=$(said "no_camera -> ")
kill -CONT $player
from=$(seconds)
wait_until 5 "frames after the silence" said_times "no_camera -> " $((so_far + 1))
figure "frames again after $(since "$from") s"
kill $player
stop_daemon
cp -t "$left" /tmp/out.lcm
