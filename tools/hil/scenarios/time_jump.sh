# SPDX-License-Identifier: Apache-2.0
# The system's time jumps an hour forwards and back: images keep their times, tracking goes on.
#@ form: long
#@ check: images run.lcm played
#@ check: lockstep run.lcm played 30
#@ check: status out.lcm frames_dropped=0..0 times_backwards=0..0 camera_losses=0..0
#@ broken: it does not jump
#@ broken_says: ^the system's time did not jump
loopback
start_playing 100
start_daemon --record /tmp/run.lcm --output /tmp/out.lcm --set camera.stall_s=30
wait_until 20 "the stream" says "streams GREY"
go
wait_until 30 "tracking" says "-> tracking"
jump() {
  local from=$(date +%s)
  [ -n "$BROKEN" ] || date -s "@$((from + $1))" > /dev/null
  local by=$(($(date +%s) - from))
  [ $by = "$1" ] || [ $by = $(($1 + 1)) ] || fail "the system's time did not jump"
}
jump 3600
sleep 2
jump -3600
wait $player || fail "the frames could not be played"
stop_daemon
[ "$(said "-> no_camera")" -le 2 ] || fail "no_camera was said because of the time"
! says "-> lost" || fail "tracking was lost"
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/farpoint.yaml
