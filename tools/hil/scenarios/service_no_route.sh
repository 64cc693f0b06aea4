# SPDX-License-Identifier: Apache-2.0
# Without LCM's route the service tracks and sends on CAN, in one process; LCM works soon after the route is there.
#@ form: long
#@ machine: systemd
#@ needs: package
#@ broken: the route never comes
#@ broken_says: ^LCM with its route: not within
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"
systemctl stop systemd-networkd.socket systemd-networkd
install_package /dev/video10
ip route delete 239.255.76.67/32 dev lo 2> /dev/null
ip route delete 224.0.0.0/4 dev lo 2> /dev/null
loopback
udevadm settle
write_configuration /etc/farpoint/farpoint.yaml /run/farpoint/control /dev/video10 /etc/farpoint/camera.yaml "can:
  enabled: true
  interface: vcan0
  wheels_dbc: none"
start_service
journal_says "LCM: .*tries again every second" || fail "the log does not name LCM"
timeout 5 candump -n 250 -L vcan0 > /tmp/can.log || fail "$(wc -l < /tmp/can.log) CAN frames in 5 s, expected 250"
figure "250 CAN frames without a route"
pid=$(main_pid)
sleep 3
[ "$(main_pid)" = "$pid" ] && [ "$(property NRestarts)" = 0 ] || fail "the service was started anew"

[ -n "$BROKEN" ] || ip route add 239.255.76.67/32 dev lo || fail "no route"
from=$(seconds)
wait_until 3 "LCM with its route" journal_says "LCM: works now"
figure "LCM works $(since "$from") s after its route came"
stop_service
