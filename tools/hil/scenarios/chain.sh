export CCACHE_DIR=/root/.cache/farpoint/ccache
cd /work/wt/slamscale
for t in "test_estimator test_map test_tracking" farpointd "test_mapping test_geometry" test_replay test_realtime; do
  nice -n 5 cmake --build --preset release -j2 --target $t -- -k 0 > "/tmp/sc/b_${t%% *}.log" 2>&1
  echo "$t $?" >> /tmp/sc/chain.log; date >> /tmp/sc/chain.log
done
