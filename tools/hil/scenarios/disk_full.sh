# SPDX-License-Identifier: Apache-2.0
# The disk of the recording is full: what was written stays and replays, the files on the other disk are whole.
#@ form: long
#@ check: lockstep kept.lcm played 20
#@ check: status out.lcm frames_valid=50..200 frames_dropped=0..0
#@ broken: the disk has room
#@ broken_says: ^the log does not name the full disk
size=4m
[ -z "$BROKEN" ] || size=64m
mkdir /tmp/small
mount -t tmpfs -o size=$size tmpfs /tmp/small || fail "no small disk"
loopback
start_playing 100
start_daemon --record /tmp/small/run.lcm --output /tmp/out.lcm
wait_until 20 "the stream" says "streams GREY"
go
wait $player || fail "the frames could not be played"
kill -TERM $daemon
wait $daemon
ended=$?
says "images left out so far" || fail "the log does not name the full disk"
[ $ended = 1 ] || fail "the daemon ended with status $ended, expected 1"
parts=$(ls /tmp/small)
[ "$parts" = run.lcm ] || fail "on the full disk: $parts, expected run.lcm alone"
figure "$(stat -c %s /tmp/small/run.lcm) bytes kept of a full disk"
cp /tmp/small/run.lcm "$left/kept.lcm"
cp -t "$left" /tmp/out.lcm /tmp/played /tmp/farpoint.yaml
umount /tmp/small
