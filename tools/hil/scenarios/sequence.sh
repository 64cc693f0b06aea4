# SPDX-License-Identifier: Apache-2.0
# A simulated sequence through v4l2loopback: every frame once, in order, with its time; replay gives the same poses.
#@ form: short
#@ check: images run.lcm played
#@ check: lockstep run.lcm played 30
#@ check: schedule run.lcm out.lcm 30
#@ broken: frame 50 is never sent
#@ broken_says: ^frame 50 never came; 1 of 100
loopback
start_playing 100 ${BROKEN:+50}
start_daemon --record /tmp/run.lcm --output /tmp/out.lcm
wait_until 20 "the stream" says "streams GREY"
go
wait $player || fail "the frames could not be played"
/tmp/farpoint ctl status --socket $control || fail "no answer of the control socket"
stop_daemon
cp -t "$left" /tmp/run.lcm /tmp/out.lcm /tmp/played /tmp/farpoint.yaml
