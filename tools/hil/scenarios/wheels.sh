# SPDX-License-Identifier: Apache-2.0
# Wheel speeds of two messages of the vehicle's own DBC in over vcan, among other frames: each pair becomes a message.
#@ form: long
#@ check: wheels out.lcm wheels.log 80
#@ check: status out.lcm can_received=160..160
#@ broken: the DBC has another factor
#@ broken_says: ^wheels 0: .* m/s, expected
loopback
modprobe -a vcan can-raw && ip link add vcan0 type vcan && ip link set up vcan0 || fail "no vcan"
vehicle_dbc ${BROKEN:+0.02}
# Every 50 ms both axles, from backwards to forwards, and a frame that is not read.
for n in {0..79}; do
  speed=$((60 * n - 1500))
  at=$((n / 20)).$(printf %06d $((n % 20 * 50000)))
  front=$(printf %04X%04X00000000 $((speed & 65535)) $((speed + 7 & 65535)))
  left_rear=$(printf %04X $((speed + 20 & 65535))) right_rear=$(printf %04X $((speed + 31 & 65535)))
  rear=${left_rear:2}${left_rear::2}${right_rear:2}${right_rear::2}00000000
  printf '(%s) vcan0 %s\n' "$at" "123#$front" "$at" "125#$front" "$at" "124#$rear"
done > /tmp/vehicle.log
start_playing 100
start_daemon --output /tmp/out.lcm --set can.enabled=true --set can.interface=vcan0 \
  --set can.wheels_dbc=/tmp/vehicle.dbc --set can.wheel_signals=$wheel_signals
wait_until 20 "the stream" says "streams GREY"
go
candump -L vcan0,120:7F8 > /tmp/wheels.log &
dump=$!
sleep 0.5
canplayer -I /tmp/vehicle.log || fail "the vehicle's frames could not be played"
sleep 0.5
kill $dump
kill $player
stop_daemon
cp -t "$left" /tmp/out.lcm /tmp/wheels.log /tmp/played
