# SPDX-License-Identifier: Apache-2.0
# The guest boots, runs the build's own programs on its own libraries, and hands their status to the host.
#@ form: short
#@ broken: the scenario ends with status 7
#@ broken_says: ^status 7
/tmp/farpointd --version || fail "farpointd does not run"
/tmp/farpoint --help > /dev/null || fail "farpoint does not run"
/tmp/farpointd --set no.key=1 --replay /nowhere 2>&1 | tee /tmp/refusal
[ "${PIPESTATUS[0]}" = 2 ] || fail "a wrong key gave another status than 2"
figure "$(uname -r), $(seconds) s from boot"
exit ${BROKEN:+7}
