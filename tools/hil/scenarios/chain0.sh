export CCACHE_DIR=/root/.cache/farpoint/ccache
cd /work/wt/slamscale
while [ "$(grep -c test_estimator /tmp/sc/chain.log 2>/dev/null)" != 1 ]; do sleep 2; done
