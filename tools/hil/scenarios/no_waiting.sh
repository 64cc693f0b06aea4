# SPDX-License-Identifier: Apache-2.0
# Five minutes of tracking, odometry and LCM going out: the kernel's tracer sees no heap call and one wait a thread.
#@ form: long
#@ seconds: 900
#@ check: quiet trace 2900 fp-capture=do_sys_poll fp-tracking=futex_wait_queue=futex fp-output=futex_wait_queue
#@ broken: every ioctl takes memory from the heap
#@ broken_says: ^fp-capture .* heap calls
frames=3100
[ -z "$BROKEN" ] || { frames=200; export LD_PRELOAD=/tmp/heap_in_ioctl.so; cp "$root/heap_in_ioctl.so" /tmp; }
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan0"
ip route add 239.255.76.67/32 dev lo && ip link set lo multicast on || fail "no route for LCM"
start_playing $frames
start_daemon --set can.enabled=true --set can.interface=vcan0 --set can.rate_hz=50 --set lcm.enabled=true
unset LD_PRELOAD
wait_until 20 "the stream" says "streams GREY"

tracing=/sys/kernel/tracing
mount -t tracefs tracefs $tracing || fail "no tracefs"
cp "$root/symbol_places.so" /tmp
# LD_PRELOAD only for a program that does nothing: its constructor says where the functions are.
LD_PRELOAD=/tmp/symbol_places.so /bin/true > /tmp/places
[ "$(wc -l < /tmp/places)" = 6 ] || fail "where the heap's functions are is not known: $(cat /tmp/places)"
while read -r name file offset; do
  echo "p:heap/$name $file:$offset" >> $tracing/uprobe_events || fail "no uprobe of $name at $file:$offset"
done < /tmp/places

untrace() {
  for trigger in $tracing/events/{heap/*,raw_syscalls/sys_enter,sched/sched_switch}/trigger; do
    grep -q ^hist "$trigger" && echo "!$(grep ^hist "$trigger" | sed 's/ \[active\]//')" > "$trigger"
  done
  echo > $tracing/uprobe_events
  umount $tracing
}
trap 'untrace; bring_back' EXIT
# trace EVENT KEYS [FILTER]
trace() { echo "hist:keys=$2:size=4096${3:+ if $3}" > "$tracing/events/$1/trigger" || fail "no histogram of $1"; }
go
wait_until 60 "poses" says "-> tracking"
# Settled, and everything that is done once was.
for _ in $(seq 40); do rest; done
for task in /proc/$daemon/task/*; do echo "${task##*/} $(cat "$task/comm")"; done > "$left/threads"
while read -r name _; do trace "heap/$name" common_pid; done < /tmp/places
trace raw_syscalls/sys_enter common_pid,id
trace sched/sched_switch prev_pid,stacktrace "prev_state & 255"
wait $player || fail "the frames could not be played"
for histogram in $tracing/events/{heap/*,raw_syscalls/sys_enter,sched/sched_switch}/hist; do
  event=${histogram%/hist}
  cat "$histogram" > "$left/trace.${event##*/}"
done
/tmp/farpoint ctl status --socket $control > "$left/state" || fail "no answer of the control socket"
stop_daemon
