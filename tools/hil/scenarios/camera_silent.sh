# SPDX-License-Identifier: Apache-2.0
# A USB camera that stops without an error: no_camera, its stream started anew, and tracked again when it goes on.
#@ form: short
#@ check: images run.lcm played 20000 1
#@ check: status out.lcm camera_losses=2..5 frames_dropped=0..0 times_backwards=0..0 images_flagged=0..0
#@ broken: it does not stop
#@ broken_says: ^no_camera is said: not within
modprobe -a vhci-hcd uvcvideo || fail "no USB cameras"
plug_in
wait_until 20 "the USB camera's node" test -e /dev/video0
start_daemon --set camera.device=/dev/video0 --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 20 "the stream" says "streams GREY"
wait_until 30 "tracking" says "-> tracking"
so_far=$(said "-> no_camera")
[ -n "$BROKEN" ] || kill -USR1 $camera
from=$(seconds)
wait_until 3 "no_camera is said" said_times "-> no_camera" $((so_far + 1))
figure "no_camera after $(since "$from") s"
sleep 3
says "no image came, the stream is started anew" || fail "the stream is not started anew"
[ "$(said "no_camera -> ")" = "$so_far" ] || fail "frames were tracked during the silence"
kill -USR1 $camera
from=$(seconds)
wait_until 5 "frames after the silence" said_times "no_camera -> " $((so_far + 1))
figure "frames again after $(since "$from") s"
wait_until 10 "tracking after the silence" says "relocalising -> tracking"
figure "tracks again after $(since "$from") s"
stop_daemon
unplug
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played
