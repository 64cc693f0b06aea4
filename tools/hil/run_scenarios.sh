#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Runs in the guest: the scenarios that share this machine, one after the other, each cleaned up after. What a scenario
# leaves is in /hil/NAME: out, status, seconds, and what it puts there. One that boots the machine again begins anew.
export root=/hil
mountpoint -q /tmp || mount -t tmpfs tmpfs /tmp
for name in $(cat $root/names); do
  export left=$root/$name
  [ ! -e "$left/status" ] || continue
  from=$(cut -d' ' -f1 /proc/uptime)
  setsid bash "$left/scenario" > "$left/out" 2>&1 < /dev/null &
  session=$!
  wait $session
  echo $? > "$left/status"
  echo "$(cut -d' ' -f1 /proc/uptime) $from" | awk '{printf "%.0f\n", $1 - $2}' > "$left/seconds"

  pkill -KILL -s $session
  if command -v farpointd > /dev/null; then
    systemctl stop farpointd
    systemctl revert farpointd
    dpkg -P farpoint
  fi > /dev/null 2>&1
  ip link delete vcan0 2> /dev/null
  ip route delete 239.255.76.67/32 dev lo 2> /dev/null
  sleep 0.5
  for module in v4l2loopback vivid vimc uvcvideo vhci-hcd sch_tbf vcan kvaser_pci; do rmmod $module 2> /dev/null; done
  rm -rf /tmp/*
done
exit 0
