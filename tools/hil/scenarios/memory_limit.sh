# SPDX-License-Identifier: Apache-2.0
# The service's memory limit is hit while it tracks: it alone is killed and comes again; with room it tracks again.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: the limit stays as it is
#@ broken_says: ^the kill at the limit: not within
killed_for_memory() { [ "$(property NRestarts)" -ge 1 ] && journal_says "oom-kill"; }
install_service
start_service
pid=$(main_pid)
used_mb=$(($(property MemoryCurrent) / 1000000))

# Locked memory cannot be taken back, so a limit below what is in use is hit at once.
[ -n "$BROKEN" ] || systemctl set-property --runtime farpointd MemoryMax=$((used_mb / 2))M
from=$(seconds)
wait_until 10 "the kill at the limit" killed_for_memory
figure "limit halved at $used_mb MB in use: killed and started anew after $(since "$from") s"
kill -0 $player || fail "another process was killed for it"

systemctl set-property --runtime farpointd MemoryMax=2G
wait_until 20 "another start" has_other_pid "$pid"
wait_until 30 "frames tracked with room again" service_tracks
figure "tracks again $(since "$from") s after the limit"
stop_service
