# The same odometry in CAN FD's frames at 50 Hz, on a vcan of their size.
#@ form: long
#@ check: bus can.log played 50 valid fd
#@ broken: the frames are classic ones
#@ broken_says: ^a classic frame
loopback
modprobe -a vcan can-raw || fail "no vcan"
ip link add vcan0 mtu 72 type vcan && ip link set up vcan0 || fail "no vcan0"
fd=true
[ -z "$BROKEN" ] || fd=false
carry_odometry vcan0 vcan0 --set can.fd=$fd
