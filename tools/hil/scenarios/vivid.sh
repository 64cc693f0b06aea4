# SPDX-License-Identifier: Apache-2.0
# A simulated sequence through vivid's HDMI output, wired to its input: each image is a frame, in order, in its time.
#@ form: long
#@ check: wired run.lcm played 101700 100 10
#@ check: schedule run.lcm out.lcm 30
#@ check: status out.lcm frames_valid=60..200 frames_dropped=0..0 times_backwards=0..0 camera_losses=0..0
#@ broken: the output is not wired to the input
#@ broken_says: ^image 0 is none of the frames
# Timings with 10 frames a second are those of large frames. The sequence's are in their corner: the output may place
# them there (2), and the input cut them out (1).
modprobe vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=0x3 num_outputs=1 output_types=1 \
  ccs_cap_mode=1 ccs_out_mode=2 || fail "no vivid"
node() { grep -l "vivid.*vid-$1" /sys/class/video4linux/*/name | head -1 | cut -d/ -f5; }
has_nodes() { [ -e "/dev/$(node out)" ] && [ -e "/dev/$(node cap)" ]; }
wait_until 10 "vivid's nodes" has_nodes
output=/dev/$(node out) input=/dev/$(node cap)
# The input rounds its clock, to 9.83 Hz; the output takes 9.95 Hz as they are. So the output overtakes the input once
# in 83 frames, twice in this run at most. It gains 1.2 ms a frame, and either keeps its time to 4 ms (a jiffy): four
# frames around it, or five, are early or late.
for device in $output $input; do
  v4l2-ctl -d "$device" --set-dv-bt-timings cvt,width=1600,height=1200,fps=10,reduced-blanking=1 ||
    fail "$device does not take the timings"
done
v4l2-ctl -d "$input" -c osd_text_mode=2 || fail "vivid writes on its images"
[ -n "$BROKEN" ] || v4l2-ctl -d "$input" -c loop_video=1 || fail "vivid's output cannot be wired to its input"

# At the pace of the output, before the first image is taken and after the last.
touch /tmp/go
/tmp/play "$output" 320x240 0 100000 /tmp/go /tmp/frames.grey > /tmp/played &
player=$!
wait_until 10 "frames sent" grep -q "^9 " /tmp/played
start_daemon --set camera.device="$input" --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 20 "the stream" says "streams GREY"
sleep 11
kill -0 $player || fail "the frames could not be played"
stop_daemon
kill $player
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/farpoint.yaml
