# SPDX-License-Identifier: Apache-2.0
# The service: ready, as its own user; a hung tracker and a killed process come again in time; it stops in order.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: the tracker does not hang
#@ broken_says: ^restart of a hung tracker: not within
install_service
start_service
pid=$(main_pid)
user=$(ps -o user= -p "$pid")
[ "$user" = farpoint ] || fail "the service runs as $user, expected farpoint"
grep -q "^CapEff:[[:space:]]*0*$" "/proc/$pid/status" || fail "the service has capabilities: $(grep CapEff "/proc/$pid/status")"

# WatchdogSec is 2 s: one second more for the signal and the start.
watchdog_s=3
[ -n "$BROKEN" ] || /tmp/stop_thread "$pid" fp-tracking 30 &
from=$(seconds)
wait_until $watchdog_s "restart of a hung tracker" is_started_anew "$pid"
figure "a hung tracker's process is another after $(since "$from") s"
journal_says "Watchdog timeout" || fail "systemd did not say that the watchdog ended it"
wait_until 30 "frames tracked after the hang" service_tracks

pid=$(main_pid)
kill -KILL "$pid"
from=$(seconds)
wait_until 5 "restart after kill -9" has_other_pid "$pid"
figure "ready $(since "$from") s after kill -9"
pid=$(main_pid)
wait_until 30 "the first pose after kill -9" first_pose_is_out "$pid"
first_s=$(journal_time "$pid" "streams GREY") pose_s=$(journal_time "$pid" "initialising -> ")
took_s=$(difference "$pose_s" "$first_s")
at_most "$took_s" 3 || fail "the first pose came $took_s s after the camera's stream, expected at most 3"
figure "first pose $took_s s after the stream"

[ "$(property NRestarts)" = 2 ] || fail "systemd counts $(property NRestarts) restarts, expected 2"
stop_service
at_most "$stopped_in_s" 1 || fail "stopped after $stopped_in_s s, expected at most 1"
figure "stops in $stopped_in_s s"
