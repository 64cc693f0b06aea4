# SPDX-License-Identifier: Apache-2.0
# The bus's interface goes down, away, and its queue fills up: the frames come again by themselves, none of them stale.
#@ form: long
#@ check: bus after_down.log played 50
#@ check: bus after_away.log played 50
#@ check: bus after_full.log played 50
#@ broken: the interface stays down
#@ broken_says: ^frames after the interface was down: not within
modprobe -a vcan can-raw sch_tbf || fail "no vcan"
make_bus() { ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"; }
# receive WHAT: waits for frames again, then keeps those of some seconds.
receive() {
  local from dump
  from=$(seconds)
  candump -D -L vcan0 > "/tmp/after_$1.log" 2> /dev/null &
  dump=$!
  wait_until 5 "frames after the interface was $1" test -s "/tmp/after_$1.log"
  figure "$1: frames again after $(since "$from") s"
  sleep 4
  kill $dump
  cp "/tmp/after_$1.log" "$left"
}

loopback
make_bus
start_playing 300
start_daemon --set can.enabled=true --set can.interface=vcan0 --set can.rate_hz=50
wait_until 20 "the stream" says "streams GREY"
go

ip link set vcan0 down
sleep 1
[ -n "$BROKEN" ] || ip link set vcan0 up
receive down

ip link delete vcan0
sleep 1
make_bus
receive away

tc qdisc add dev vcan0 root tbf rate 8kbit burst 64 limit 160 || fail "no queue to fill"
sleep 2
tc qdisc delete dev vcan0 root
receive full

kill $player
stop_daemon
cp /tmp/played "$left"
refused=$(not_sent)
[ "$refused" -ge 100 ] || fail "only $refused CAN frames were counted as not sent"
figure "$refused frames counted as not sent"
