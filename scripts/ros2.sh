#!/usr/bin/env bash
# `omnistep run --ros2` watched, steered and troubled by foreign implementations of DDS, Cyclone DDS and Fast DDS,
# in a network of their own that nothing leaves. What cannot be tried for want of a tool is said; with
# ROS2=required a tool that can be installed has to be there, as in .ci/run. ROS2_SOAK_S: seconds of the test that
# looks for leaks, 20 unless set. OMNISTEP: another program than the package's. Further arguments go to pytest.
set -euo pipefail
cd "$(dirname "$0")/.."
lacking() { # what cannot be tried, what is missing
    echo "SKIPPED $1; missing: $2" >&2
    [ "${ROS2:-}" != required ] || exit 1
}
# In a network of one's own; without root in a user's own, where the system allows that.
own=(unshare --net --mount)
[ "$(id -u)" = 0 ] || own+=(--user --map-root-user)
for tool in unshare ip; do
    command -v "$tool" >/dev/null || { lacking "the tests of ROS 2" "$tool (apt install util-linux iproute2)"; exit 0; }
done
# No package gives this right: it is said, and no failure.
"${own[@]}" ip link set lo up 2>/dev/null || { echo "SKIPPED the tests of ROS 2; this system does not allow a separate network (unshare --net)" >&2; exit 0; }
scripts/tools/venv.sh
.venv/bin/python -c 'import cyclonedds' 2>/dev/null ||
    { lacking "the tests of ROS 2" "cyclonedds, which has no wheel for this Python or machine"; exit 0; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fast_dds=$work/fast_dds
if echo '#include <fastdds/dds/domain/DomainParticipant.hpp>' | "${CXX:-c++}" -std=c++17 -x c++ -fsyntax-only - 2>/dev/null; then
    "${CXX:-c++}" -std=c++17 -O1 -Wall -Wextra -Werror tests/ros2/fast_dds.cpp -lfastrtps -lfastcdr -o "$fast_dds"
else
    lacking "what needs Fast DDS" "its headers (apt install libfastrtps-dev)"
    fast_dds=
fi
OMNISTEP=$(realpath "${OMNISTEP:-.venv/bin/omnistep}") # with all features
# What the peers share in memory is their own too, and goes with them.
inside='
    mount -t tmpfs tmpfs /dev/shm
    ip link set lo up
    ip link set lo multicast on
    ip route add 239.255.0.0/16 dev lo
    exec "$@"'
OMNISTEP=$OMNISTEP FAST_DDS_PEER=$fast_dds ROS2_NETWORK=own "${own[@]}" bash -euc "$inside" - .venv/bin/python -m pytest tests/ros2 "$@"
