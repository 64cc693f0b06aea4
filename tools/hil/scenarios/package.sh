# SPDX-License-Identifier: Apache-2.0
# The .deb: installed, upgraded while the service runs, removed, purged; the configuration outlives all except the last, a camera file all.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: the package of the upgrade does not restart the service
#@ broken_says: ^restart by the upgrade: not within
install_service
start_service
pid=$(main_pid)

dpkg-deb -R "$root/farpoint.deb" /tmp/next || fail "the package cannot be unpacked"
sed -i 's/^Version: .*/&+next/' /tmp/next/DEBIAN/control
[ -z "$BROKEN" ] || sed -i '/try-restart/d' /tmp/next/DEBIAN/postinst
dpkg-deb -b -Znone /tmp/next /tmp/next.deb > /dev/null || fail "the next version cannot be made"
dpkg -i --force-confdef --force-confold /tmp/next.deb > /tmp/dpkg.log 2>&1 || fail "upgrade: $(tail -1 /tmp/dpkg.log)"
from=$(seconds)
wait_until 10 "restart by the upgrade" has_other_pid "$pid"
wait_until 30 "frames tracked after the upgrade" service_tracks
figure "upgraded while running, tracks again after $(since "$from") s"
grep -q "features: 300" /etc/farpoint/farpoint.yaml || fail "the upgrade replaced the configuration"

dpkg -r farpoint > /tmp/dpkg.log 2>&1 || fail "removal: $(tail -1 /tmp/dpkg.log)"
! systemctl -q is-active farpointd || fail "the removal left the service running"
! command -v farpointd || fail "the removal left the program"
! has_lcm_route || fail "the removal left LCM's route"
grep -q "features: 300" /etc/farpoint/farpoint.yaml || fail "the removal took the configuration"
[ -e /etc/farpoint/camera.yaml ] || fail "the removal took the camera file"
[ -s /var/lib/farpoint/boot_counter ] || fail "the removal took the boot counter"
dpkg -P farpoint > /tmp/dpkg.log 2>&1 || fail "purge: $(tail -1 /tmp/dpkg.log)"
[ -e /etc/farpoint/camera.yaml ] || fail "the purge took the camera file"
for gone in /etc/farpoint/farpoint.yaml /var/lib/farpoint/boot_counter; do
  [ ! -e "$gone" ] || fail "the purge left $gone"
done
[ -z "$(systemctl --failed --no-legend | grep farpoint)" ] || fail "a failed unit is left"
figure "removed with the configuration kept, purged with the camera file kept"
