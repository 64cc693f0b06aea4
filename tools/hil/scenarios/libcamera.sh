# SPDX-License-Identifier: Apache-2.0
# A USB camera of the kernel's uvcvideo through libcamera: every frame once, in order; unplugged and plugged in again.
#@ form: long
#@ needs: libcamera
#@ check: images run.lcm played 20000 2
#@ check: status out.lcm camera_losses=1..1 frames_dropped=0..0 times_backwards=0..0 images_flagged=0..0
#@ broken: it is not plugged in again
#@ broken_says: ^stream after unplugging: not within
modprobe -a vhci-hcd uvcvideo || fail "no USB cameras"
prepare_libcamera
plug_in
wait_until 20 "the USB camera's node" test -e /dev/video0
udevadm settle
echo '\_SB_.VHC0' > /tmp/node
daemon_command=(env FIRMWARE_NODE=/tmp/node LD_PRELOAD="$root/firmware_node.so" "${daemon_command[@]}")
from=$(seconds)
start_daemon --set camera.driver=libcamera --set camera.device=0 --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 30 "the stream" said_times "streams GREY" 1
figure "streams after $(since "$from") s"
wait_until 30 "tracking" says "-> tracking"
unplug
wait_until 5 "the unplugging is noticed" said_times "lost:" 1
from=$(seconds)
[ -n "$BROKEN" ] || plug_in
wait_until 30 "stream after unplugging" said_times "streams GREY" 2
figure "streams again after $(since "$from") s"
wait_until 10 "tracking after unplugging" says "relocalising -> tracking"
stop_daemon
figure "stopped in $stopped_in_s s"
unplug
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played
