# SPDX-License-Identifier: Apache-2.0
# The machine boots with the service enabled and a USB camera that sends: from the kernel's start to the first pose.
#@ form: long
#@ machine: reboots
#@ needs: package
#@ broken: the service is not enabled
#@ broken_says: ^the service is not active after the boot
unit() { cat > "/etc/systemd/system/$1"; }

# What has to be on the disk when the machine boots.
prepare() {
  install_package /dev/video0
  install -D -t /opt/camera /tmp/usb_camera /tmp/frames.grey
  unit camera.service <<'UNIT'
[Unit]
Description=The camera: there as early as one that is built in
DefaultDependencies=no
After=systemd-udevd.service
[Service]
ExecStartPre=/sbin/modprobe -a vhci-hcd uvcvideo
ExecStart=/opt/camera/usb_camera 320x240 10 /opt/camera/frames.grey
StandardOutput=null
[Install]
WantedBy=sysinit.target
UNIT
  # What follows looks only, and takes nothing of what is measured.
  mkdir -p /etc/systemd/system/hil.service.d
  unit hil.service.d/later.conf <<'UNIT'
[Service]
ExecStartPre=sh -c 'cat /proc/stat > /run/stat_at_multi_user; exec sleep 10'
UNIT
  systemctl enable systemd-networkd camera || fail "the machine's units cannot be enabled"
  [ -n "$BROKEN" ] || systemctl enable farpointd || fail "the service cannot be enabled"
}

if [ ! -e "$left/prepared" ]; then
  prepare
  touch "$left/prepared"
  systemctl reboot
  sleep infinity
fi
echo "booted" >> "$left/prepared"
[ "$(wc -l < "$left/prepared")" = 1 ] || fail "the machine booted once more by itself: see its console"
[ -n "$(journalctl -b -o cat -u camera --no-pager)" ] || fail "the camera was not started by the boot"
systemctl -q is-active farpointd || fail "the service is not active after the boot"
wait_until 30 "the service tracks frames" service_tracks
has_lcm_route || fail "no route for LCM after the boot"
[ "$(property NRestarts)" = 0 ] || fail "systemd counts $(property NRestarts) restarts, expected none"
pid=$(main_pid)

seconds_of() { property "$1Monotonic" | awk '{printf "%.2f", 1e-6 * $1}'; }
started_s=$(seconds_of InactiveExitTimestamp) ready_s=$(seconds_of ActiveEnterTimestamp)
stream_s=$(journal_time "$pid" "streams GREY") pose_s=$(journal_time "$pid" "initialising -> ")
[ -n "$stream_s" ] && [ -n "$pose_s" ] || fail "the stream or the first pose was not said"
# within SECONDS WHAT LATER EARLIER: the scenario fails where it took longer.
within() {
  local took
  took=$(difference "$3" "$4")
  at_most "$took" "$1" || fail "$2 took $took s, expected at most $1"
  figure "$2 $took s"
}
within 15 "kernel's start to first pose" "$pose_s" 0
within 15 "kernel's start to READY" "$ready_s" 0
within 2 "service's start to READY" "$ready_s" "$started_s"
within 4 "service's start to first pose" "$pose_s" "$started_s"
within 2 "stream to first pose" "$pose_s" "$stream_s"
figure "the processor worked $(awk '/^cpu /{printf "%.1f", ($2 + $3 + $4 + $7 + $8) / 100}' /run/stat_at_multi_user) s"
stop_service
