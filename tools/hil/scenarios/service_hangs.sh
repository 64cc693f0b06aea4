# SPDX-License-Identifier: Apache-2.0
# Each of the four threads held: the log names it, and the service is another process in time.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: no thread is held
#@ broken_says: ^restart with fp-capture held: not within
install_service
start_service
# hang THREAD SECONDS: its limit (keys watchdog.*), WatchdogSec= of 2 s, and 1.5 s for the signal and the start.
hang() {
  local pid from
  pid=$(main_pid)
  [ -n "$BROKEN" ] || /tmp/stop_thread "$pid" "$1" 30 &
  from=$(seconds)
  wait_until "$2" "restart with $1 held" is_started_anew "$pid"
  figure "$1: another process after $(since "$from") s"
  journal_says "$1 has finished nothing within its limit" || fail "the log does not name $1"
  wait_until 30 "frames tracked after $1 was held" service_tracks
}
hang fp-capture 4
hang fp-tracking 4
hang fp-output 4
hang fp-mapping 6
[ "$(property NRestarts)" = 4 ] || fail "systemd counts $(property NRestarts) restarts, expected 4"
stop_service
