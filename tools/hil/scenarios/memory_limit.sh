# The service hits its memory limit: it is killed and started again, and tracks once there is room.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: the limit is not lowered
#@ broken_says: ^the kill at the limit: not within
install_service
start_playing 100000
go
systemctl start farpointd || fail "systemctl start failed"
wait_until 30 "the service tracks frames" service_tracks
used=$(systemctl show -p MemoryCurrent --value farpointd)
[ -n "$BROKEN" ] || systemctl set-property --runtime farpointd MemoryMax=40M
wait_until 10 "the kill at the limit" journal_says "oom-kill"
systemctl set-property --runtime farpointd MemoryMax=2G
from=$(seconds)
wait_until 30 "frames tracked when there is room again" service_tracks
figure "$((used / 1000000)) MB used, limit 40 MB: killed, tracks again $(since "$from") s after there is room"
