# SPDX-License-Identifier: Apache-2.0
# What scenarios share. $left is the folder that the host reads afterwards. The machine's clock runs on, and fast, while
# all wait for that folder; nothing else waits for the host. So what must be quick is in /tmp.
daemon_log=/tmp/daemon.log
control=/tmp/control
began=$(date +%s)
cd "$root" && cp -t /tmp farpointd farpoint play usb_camera stop_thread frames.grey camera.yaml

bring_back() { cp -t "$left" /tmp/figures /tmp/complaint $daemon_log 2> /dev/null; }
trap bring_back EXIT

# fail TEXT: ends the scenario with this complaint.
fail() {
  echo "$*" > /tmp/complaint
  echo "complaint: $*"
  tail -20 $daemon_log 2> /dev/null
  journalctl -b -u systemd-networkd -u dbus -o short-monotonic --no-pager 2> /dev/null | tail -20
  journalctl -u farpointd --since "@$began" -o short-monotonic --no-pager 2> /dev/null | tail -40
  exit 1
}

# figure TEXT: for the table.
figure() { echo "$*" >> /tmp/figures; }

# Without further processes, each of which costs the emulated processor some ms.
hundredths() { read -r uptime _ < /proc/uptime; now=${uptime/./}; }
seconds() { hundredths; echo "$((now / 100)).$(printf %02d $((now % 100)))"; }
# since S: seconds since then.
since() { hundredths; local past=$((now - 10#${1/./})); echo "$((past / 100)).$(printf %02d $((past % 100)))"; }
at_most() { echo "$1 $2" | awk '{exit !($1 <= $2)}'; }
mkfifo /tmp/never
exec {never}<> /tmp/never
rest() { read -r -t 0.05 -u $never; }

# wait_until SECONDS WHAT COMMAND...: the scenario fails where COMMAND does not succeed in time.
wait_until() {
  local for_s=$1 what=$2 last
  shift 2
  hundredths
  last=$((now + 100 * for_s))
  until "$@" > /dev/null 2>&1; do
    hundredths
    [ $now -le $last ] || fail "$what: not within $for_s s"
    rest
  done
}

says() { grep -q -- "$1" $daemon_log; }
# The number of such lines.
said() { grep -c -- "$1" $daemon_log; }
said_times() { [ "$(said "$1")" -ge "$2" ]; }

# Few features of small images: what the guest's processor tracks live.
write_configuration() {
  cat > "$1" <<YAML
control:
  socket: ${2:-$control}
camera:
  device: ${3:-/dev/video10}
  calibration: ${4:-/tmp/camera.yaml}
  rate_hz: 10
  lost_after_s: 0.5
  exposure: camera
pyramid:
  levels: 4
extractor:
  features: 300
capacity:
  keyframes: 200
  landmarks: 8000
initialisation:
  min_landmarks: 40
tracking:
  min_inliers: 15
  degraded_inliers: 25
${5:-}
YAML
}

daemon_command=(/tmp/farpointd)
# start_daemon ARGUMENT...: live, without LCM's network unless it is asked for.
start_daemon() {
  write_configuration /tmp/farpoint.yaml
  "${daemon_command[@]}" --config /tmp/farpoint.yaml --set lcm.enabled=false "$@" > $daemon_log 2>&1 &
  daemon=$!
  wait_until 30 "the daemon's start" says "live from"
}

stop_daemon() {
  local from
  from=$(seconds)
  kill -TERM $daemon
  wait $daemon || fail "the daemon ended with status $? at SIGTERM"
  stopped_in_s=$(since "$from")
}

# How many CAN frames the daemon that was stopped counted as not sent.
not_sent() {
  local count
  count=$(grep -o '[0-9]* CAN frames were not sent' $daemon_log | cut -d' ' -f1)
  echo "${count:-0}"
}

# carry_odometry SENDER RECEIVER ARGUMENT...: the sequence, and its odometry at 50 Hz; what came is left in can.log.
carry_odometry() {
  local sender=$1 receiver=$2 dump
  shift 2
  start_playing 100
  start_daemon --set can.enabled=true --set can.interface="$sender" --set can.rate_hz=50 "$@"
  wait_until 20 "the stream" says "streams GREY"
  go
  wait_until 20 "poses" says "-> tracking"
  candump -L "$receiver" > /tmp/can.log &
  dump=$!
  wait $player || fail "the frames could not be played"
  kill $dump
  stop_daemon
  cp /tmp/played /tmp/can.log "$left"
}

# loopback [NUMBERS]: /dev/videoN of each, by default of 10 alone.
loopback() {
  local numbers=${1:-10} commas
  commas=${numbers//[0-9]/}
  modprobe v4l2loopback devices=$((${#commas} + 1)) video_nr="$numbers" exclusive_caps="0${commas//,/,0}" max_buffers=8 ||
    fail "no v4l2loopback"
}

# start_playing FRAMES [LEAVE_OUT]: the simulated sequence at 10 Hz, half its pace; it begins with `go`.
start_playing() {
  rm -f /tmp/go
  /tmp/play /dev/video10 320x240 10 "$1" /tmp/go /tmp/frames.grey ${2:+"$2"} > /tmp/played &
  player=$!
}
go() { touch /tmp/go; }

# vehicle_dbc [FACTOR]: a vehicle's wheel speeds in two messages, one in each byte order; FACTOR is of the first signal.
vehicle_dbc() {
  cat > /tmp/vehicle.dbc <<DBC
BO_ 291 FRONT_AXLE: 8 ABS
 SG_ LEFT : 7|16@0- (${1:-0.01},0) [-300|300] "km/h" FARPOINT
 SG_ RIGHT : 23|16@0- (0.01,0) [-300|300] "km/h" FARPOINT
BO_ 292 REAR_AXLE: 8 ABS
 SG_ LEFT : 0|16@1- (0.01,0) [-300|300] "km/h" FARPOINT
 SG_ RIGHT : 16|16@1- (0.01,0) [-300|300] "km/h" FARPOINT
DBC
}
wheel_signals=FRONT_AXLE.LEFT,FRONT_AXLE.RIGHT,REAR_AXLE.LEFT,REAR_AXLE.RIGHT

# A USB camera that plays the same frames, at 10 Hz.
plug_in() {
  /tmp/usb_camera 320x240 10 /tmp/frames.grey >> /tmp/played &
  camera=$!
}
unplug() {
  kill $camera
  wait $camera
}

# libcamera learns of cameras from udev, and farpointd loads its module from beside its own folder.
prepare_libcamera() {
  mkdir -p /tmp/installed/bin
  cp /tmp/farpointd /tmp/installed/bin/ && cp -r "$root/lib" /tmp/installed/ || fail "no libcamera module"
  daemon_command=(/tmp/installed/bin/farpointd)
  /lib/systemd/systemd-udevd > /tmp/udevd.log 2>&1 &
  wait_until 10 "udev" udevadm control --ping
  udevadm trigger --action=add
  udevadm settle
}

# --- the installed package, in a machine that systemd runs

property() { systemctl show -p "$1" --value farpointd; }
main_pid() { property MainPID; }
# is_started_anew PID: the service has another process. has_other_pid PID: and that has said that it is ready.
is_started_anew() {
  local now
  now=$(main_pid)
  [ "$now" != "$1" ] && [ "$now" != 0 ]
}
has_other_pid() { is_started_anew "$1" && systemctl -q is-active farpointd; }
journal_says() { journalctl -u farpointd --since "@$began" -o cat --no-pager | grep -q -- "$1"; }
# service_tracks: this process of it has tracked some frames; by what it tells systemd every second.
service_tracks() {
  [[ $(property StatusText) =~ \ ([0-9]+)\ frames\ tracked ]] &&
    [ "${BASH_REMATCH[1]}" -ge 5 ]
}

# journal_time PID PATTERN: when that process first said so, in s since the kernel's start.
journal_time() {
  journalctl -u farpointd _PID="$1" -o short-monotonic --no-pager |
    sed -n "/$2/{s/^\[ *\([0-9.]*\)\].*/\1/p;q}"
}
first_pose_is_out() { [ -n "$(journal_time "$1" "initialising -> ")" ]; }
# difference LATER EARLIER: in s.
difference() { echo "$1 $2" | awk '{printf "%.2f", $1 - $2}'; }

# install_package DEVICE: the package, and the configuration for the guest and that camera.
install_package() {
  dpkg -i "$root/farpoint.deb" > /tmp/dpkg.log 2>&1 || { cat /tmp/dpkg.log; fail "dpkg -i: $(tail -1 /tmp/dpkg.log)"; }
  write_configuration /etc/farpoint/farpoint.yaml /run/farpoint/control "$1" /etc/farpoint/camera.yaml
  install -m 644 /tmp/camera.yaml /etc/farpoint/camera.yaml
}
has_lcm_route() { ip route | grep -q "^239\.255\.76\.67 "; }

# The package, a loopback camera, and LCM's route, which a running networkd sets; the service is not started.
install_service() {
  systemctl start systemd-networkd
  install_package /dev/video10
  wait_until 20 "LCM's route" has_lcm_route
  loopback
  udevadm settle
}

# The service, on an installed package and frames without end: it tracks.
start_service() {
  start_playing 100000
  go
  systemctl start farpointd || fail "systemctl start failed"
  wait_until 30 "the service tracks frames" service_tracks
}

stop_service() {
  local from
  from=$(seconds)
  systemctl stop farpointd || fail "systemctl stop failed"
  stopped_in_s=$(since "$from")
  [ "$(property Result)" = success ] || fail "the stop is a failure to systemd"
}
