# SPDX-License-Identifier: Apache-2.0
# vimc, the kernel's emulated image sensor with a processing pipeline, through libcamera: it gives colours only.
#@ form: long
#@ needs: libcamera
#@ check: bars run.lcm 318x240 50
#@ check: status out.lcm camera_losses=0..0 frames_dropped=0..0 times_backwards=0..0 images_flagged=0..0
#@ broken: the sensor shows another pattern
#@ broken_says: ^image 0: bar 1 is
# Its pipeline takes multiples of six pixels.
sed -i 's/^width_px: .*/width_px: 318/' /tmp/camera.yaml
modprobe vimc || fail "no vimc"
prepare_libcamera
if [ -n "$BROKEN" ]; then
  for sensor in /dev/v4l-subdev*; do v4l2-ctl -d "$sensor" -c test_pattern=4 2> /dev/null; done
fi
start_daemon --set camera.driver=libcamera --set camera.device=0 --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 30 "the stream" says "streams RGB24"
sleep 10
stop_daemon
figure "stopped in $stopped_in_s s"
cp -t "$left" /tmp/run.lcm /tmp/out.lcm
