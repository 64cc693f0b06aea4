# The installed package under systemd: own user, READY, restart of a hung tracker and after a kill, stop in order.
#@ form: short
#@ machine: systemd
#@ needs: package
#@ broken: nothing hangs
#@ broken_says: ^restart of a hung tracker: not within
install_service
start_playing 100000
go
from=$(seconds)
systemctl start farpointd || fail "systemctl start failed"
figure "READY after $(since "$from") s"
pid=$(main_pid)
[ "$(stat -c %U "/proc/$pid")" = farpoint ] || fail "it runs as $(stat -c %U "/proc/$pid")"
journal_says "memory locked" || fail "memory is not locked in the service"
wait_until 30 "the service tracks frames" service_tracks
sleep 4  # two of the watchdog's intervals
[ "$(main_pid)" = "$pid" ] || fail "it was restarted without a fault"

from=$(seconds)
[ -n "$BROKEN" ] || /tmp/stop_thread "$pid" fp-tracking 8 &
wait_until 6 "restart of a hung tracker" has_other_pid "$pid"
hung_s=$(since "$from")
journal_says "Watchdog timeout" || fail "the restart was not the watchdog's"
at_most "$hung_s" 3 || fail "a hung tracker was restarted after $hung_s s, expected WatchdogSec + 1 s = 3 s"
figure "hung tracker restarted after $hung_s s"
wait_until 20 "frames tracked after the hang" service_tracks

pid=$(main_pid)
from=$(seconds)
kill -9 "$pid"
wait_until 5 "restart after kill -9" has_other_pid "$pid"
wait_until 20 "frames tracked after kill -9" service_tracks
figure "kill -9: tracks frames again after $(since "$from") s"

from=$(seconds)
systemctl stop farpointd
stopped_in_s=$(since "$from")
result=$(systemctl show -p Result --value farpointd)
[ "$result" = success ] || fail "stopped: $result"
at_most "$stopped_in_s" 1 || fail "the stop took $stopped_in_s s"
figure "stopped in $stopped_in_s s"
