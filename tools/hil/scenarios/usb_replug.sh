# SPDX-License-Identifier: Apache-2.0
# A USB camera of the kernel's uvcvideo, chosen by its port, is unplugged and plugged in again ten times while tracking.
#@ form: long
#@ check: images run.lcm played 20000 10
#@ check: status out.lcm camera_losses=10..10 frames_dropped=0..0 times_backwards=0..0
#@ broken: it is not plugged in again
#@ broken_says: ^stream after unplugging 1: not within
modprobe -a vhci-hcd uvcvideo || fail "no USB cameras"
plug_in
wait_until 20 "the USB camera's node" test -e /dev/video0
port=$(readlink -f /sys/class/video4linux/video0/device)  # .../usb3/3-1/3-1:1.0
port=$(basename "$(dirname "$port")")
start_daemon --set camera.device="usb:$port" --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 20 "the stream" said_times "streams GREY" 1
sleep 3
for n in 1 2 3 4 5 6 7 8 9 10; do
  unplug
  wait_until 5 "unplugging $n is noticed" said_times "lost:" "$n"
  from=$(seconds)
  [ -n "$BROKEN" ] || plug_in
  wait_until 20 "stream after unplugging $n" said_times "streams GREY" $((n + 1))
  times="$times $(since "$from")"
  sleep 1
done
stop_daemon
unplug
[ "$(said "relocalising -> tracking")" -ge 10 ] || fail "tracked again $(said "relocalising -> tracking") times of 10"
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played
times=$(tr ' ' '\n' <<< "${times# }" | sort -n)
figure "streams again after $(head -1 <<< "$times") to $(tail -1 <<< "$times") s"
