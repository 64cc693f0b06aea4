# SPDX-License-Identifier: Apache-2.0
# Twelve processes at normal priority take all they can get of the one core: with real-time priority nothing is late.
#@ form: long
#@ check: images run.lcm played
#@ check: status out.lcm frames_dropped=0..0 deadlines_missed=0..0 frames_valid=30..100 camera_losses=0..0
#@ check: schedule run.lcm out.lcm 30
#@ broken: the daemon's threads have normal priority too
#@ broken_says: ^frames_dropped|^deadlines_missed|^frame .* never came
priorities=(--set realtime.capture_priority=50 --set realtime.output_priority=49 --set realtime.tracking_priority=48)
[ -z "$BROKEN" ] || priorities=()
loopback
start_playing 100
start_daemon --record /tmp/run.lcm --output /tmp/out.lcm "${priorities[@]}"
wait_until 20 "the stream" says "streams GREY"
[ -n "$BROKEN" ] || says "fp-tracking SCHED_FIFO 48" || fail "no real-time priority: $(grep "real time" $daemon_log)"
for hog in 1 2 3 4 5 6 7 8 9 10 11 12; do
  (while :; do :; done) &
  hogs="$hogs $!"
done
go
wait $player || fail "the frames could not be played"
kill $hogs
stop_daemon
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/farpoint.yaml
