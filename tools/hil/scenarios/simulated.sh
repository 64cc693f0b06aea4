# SPDX-License-Identifier: Apache-2.0
# The simulator streams by itself: images into v4l2loopback, wheel speeds to vcan. At a twentieth of its pace.
#@ form: long
#@ check: streamed run.lcm out.lcm said 320x240 2
#@ check: status out.lcm camera_losses=0..0 frames_dropped=0..0 times_backwards=0..0
#@ broken: the simulator streams another seed's world
#@ broken_says: ^image 0 is not frame 0
loopback
modprobe -a vcan can-raw && ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan"
vehicle_dbc
cp "$root/yard.yaml" /tmp
# The guest's processor renders a frame in less than its second.
/tmp/farpoint simulate /tmp/yard.yaml ${BROKEN:+--seed 2} --size 320x240 --duration 2 --stream --pace 0.05 \
  --video /dev/video10 --can vcan0 --wheels-dbc /tmp/vehicle.dbc --wheel-signals $wheel_signals > /tmp/said &
simulator=$!
wait_until 20 "the simulator's format" sh -c 'v4l2-ctl -d /dev/video10 --get-fmt-video | grep -q 320/240'
# It renders some frames first: a long silence.
start_daemon --set camera.rate_hz=1 --set camera.lost_after_s=10 --set camera.stall_s=60 \
  --record /tmp/run.lcm --output /tmp/out.lcm \
  --set can.enabled=true --set can.interface=vcan0 \
  --set can.wheels_dbc=/tmp/vehicle.dbc --set can.wheel_signals=$wheel_signals
wait_until 20 "the stream" says "streams GREY"
grep -q "frame 0 at" /tmp/said && fail "the simulator began before the daemon streamed: $(cat /tmp/said)"
wait $simulator || fail "the simulator ended with status $?"
sleep 1
stop_daemon
figure "$(grep -o "[0-9]* late.*reached" /tmp/said)"
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/said
