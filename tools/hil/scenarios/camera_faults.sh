# SPDX-License-Identifier: Apache-2.0
# vivid: 30 % dropped buffers, buffers flagged as damaged, a fatal streaming error, a disconnected device.
#@ form: long
#@ check: status out.lcm images_missing=10..60 images_flagged=5..5 camera_losses=2..2 frames_tracked=80..200
#@ check: status out.lcm frames_dropped=0..0 times_backwards=0..0
#@ broken: no buffer is dropped
#@ broken_says: ^images_missing 0
find_vivid() { grep -l vivid.*vid-cap /sys/class/video4linux/*/name | head -1 | cut -d/ -f5; }
start_vivid() {
  modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0 || fail "no vivid"
  wait_until 10 "vivid's node" test -e "/dev/$(find_vivid)"
}
inject() { v4l2-ctl -d "$device" -c "$1" || fail "vivid has no $1"; }

start_vivid
device=/dev/$(find_vivid)
sed -i 's/^height_px: .*/height_px: 180/; s/^cy_px: .*/cy_px: 90/' /tmp/camera.yaml  # the nearest that vivid has
start_daemon --set camera.device="$device" --output /tmp/out.lcm
wait_until 20 "the stream" said_times "streams" 1

[ -n "$BROKEN" ] || inject percentage_of_dropped_buffers=30
sleep 8
inject percentage_of_dropped_buffers=0

for _ in 1 2 3 4 5; do
  inject inject_v4l2_buf_flag_error=1
  sleep 0.5
done

inject inject_fatal_streaming_error=1
from=$(seconds)
wait_until 10 "stream after a fatal error" said_times "streams" 2
figure "fatal error: streams again after $(since "$from") s"
sleep 1

# Every node says that it is gone until the last user has closed it.
inject disconnect=1
from=$(seconds)
wait_until 5 "the disconnection is noticed" said_times "lost:" 2
wait_until 10 "stream after the disconnection" said_times "streams" 3
figure "disconnected: streams again after $(since "$from") s"
sleep 1
stop_daemon
cp -t "$left" /tmp/out.lcm
