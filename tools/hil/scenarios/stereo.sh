# SPDX-License-Identifier: Apache-2.0
# Two loopback cameras of which the second stops halfway: all images are recorded, pairs counted, then those alone.
#@ form: long
#@ check: images run.lcm played
#@ check: images run.lcm played_1 0 0 CAMERA_1
#@ check: status out.lcm frames_tracked=100..100 frames_dropped=0..0 stereo_pairs=48..50 stereo_left_alone=45..52
#@ check: status out.lcm stereo_right_alone=0..1 times_backwards=0..0
#@ broken: the second camera goes on to the end
#@ broken_says: ^stereo_pairs (9[0-9]|100) at the end
loopback 10,11
echo "T_body_camera: [0, 0, 1, 0, -1, 0, 0, 0.1, 0, -1, 0, 0, 0, 0, 0, 1]" | cat /tmp/camera.yaml - > /tmp/left.yaml
echo "T_body_camera: [0, 0, 1, 0, -1, 0, 0, -0.1, 0, -1, 0, 0, 0, 0, 0, 1]" | cat /tmp/camera.yaml - > /tmp/right.yaml
start_playing 100
second_frames=50
[ -z "$BROKEN" ] || second_frames=100
/tmp/play /dev/video11 320x240 10 $second_frames /tmp/go /tmp/frames.grey > /tmp/played_1 &
second=$!
# The two players begin up to 20 ms apart, with frames every 100 ms.
start_daemon --set camera.calibration=/tmp/left.yaml --set camera.second_device=/dev/video11 \
  --set camera.second_calibration=/tmp/right.yaml --set camera.pair_tolerance_us=40000 \
  --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 20 "both streams" said_times "streams GREY" 2
go
wait $second || fail "the second camera's frames could not be played"
wait $player || fail "the frames could not be played"
figure "said of the second camera: lost $(said "video11: lost") times"
stop_daemon
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/played_1
