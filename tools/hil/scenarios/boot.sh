# The guest boots, runs the build's own programs on its own libraries, and hands their status to the host.
#@ form: short
#@ broken: the scenario ends with status 7
#@ broken_says: ^status 7
/tmp/farpointd --version || fail "farpointd does not run"
/tmp/farpoint --help > /dev/null || fail "farpoint does not run"
/tmp/farpointd --set no.key=1 --replay /nowhere --lockstep 2> /tmp/refusal
status=$?
[ $status = 2 ] && grep -q no.key /tmp/refusal || fail "a wrong key gave status $status: $(cat /tmp/refusal)"
figure "$(uname -r), $(seconds) s from boot"
exit ${BROKEN:+7}
