# SPDX-License-Identifier: Apache-2.0
# A receiver that keeps to the DBC is never deceived: start, gap, each thread held, orderly end, kill, restarts.
#@ form: long
#@ check: trust can.log played events
#@ broken: epochs of before the kill come once more after the restart, half a period of images out of step
#@ broken_says: ^the age is wrong
clock() { date +%s.%N; }
note() { echo "$*" >> /tmp/events; }
later() { echo "$1 $2" | awk '{printf "%.6f", $1 + $2}'; }
tracks_again() { wait_until 20 "tracking after $1" said_times "-> tracking" "$2"; }
launch() {
  start_daemon --set can.enabled=true --set can.interface=vcan0 --set can.rate_hz=50 --set scale.assumed=1 \
    --set state.folder=/tmp/state
  wait_until 20 "the stream" says "streams GREY"
}
launch_again() {
  note silent "$1" "$(clock)"
  note started "$(clock)"
  launch
  tracks_again "the restart" 1
  sleep 1
}
# hold THREAD: for a second and what it takes to let go. Mapping does not keep tracking from its poses.
hold() {
  local from so_far
  so_far=$(said "-> tracking")
  from=$(clock)
  /tmp/stop_thread $daemon "$1" 1 || fail "$1 cannot be held"
  [ "$1" = fp-mapping ] || note blind "$from" "$(later "$from" 1)"
  [ "$1" != fp-output ] || note held "$from" "$(clock)"
  sleep 1.5
  figure "$1 held: $(($(said "-> tracking") - so_far)) times tracking anew"
}

modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"
loopback
mkdir /tmp/state
candump -D -L vcan0 > /tmp/can.log 2> /dev/null &
start_playing 100000
launch
sleep 1
go
tracks_again "the start" 1
sleep 2

from=$(clock)
rm /tmp/go
sleep 1.5
note blind "$from" "$(clock)"
go
sleep 2
for thread in fp-capture fp-tracking fp-output fp-mapping; do hold $thread; done
stop_daemon
note stopped "$(clock)"
from=$(clock)
sleep 0.5
launch_again "$from"
kill -KILL $daemon
from=$(clock)
sleep 0.5
launch_again "$from"
stop_daemon
kill $player
if [ -n "$BROKEN" ]; then
  killed=$(sed -n 's/^silent \([0-9.]*\) .*/\1/p' /tmp/events | tail -1)
  awk -v killed="$killed" '{ at = substr($1, 2, length($1) - 2) + 0 }
    at > killed - 0.5 && at < killed - 0.2 { printf "(%.6f) %s %s\n", at + 3.05, $2, $3 }' /tmp/can.log > /tmp/stale
  sort /tmp/can.log /tmp/stale -o /tmp/can.log
fi
cp -t "$left" /tmp/played /tmp/can.log /tmp/events
