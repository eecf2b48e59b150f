"""What the tests of `omnistep run --ros2` share: domains, peers and runs, all ended with their test.

scripts/ros2.sh starts them in a network of their own: a participant of DDS would greet whatever is on the network.
"""

import itertools
import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

CYCLONE = (
    '<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>'
    "</General></Domain></CycloneDDS>"
)
os.environ["CYCLONEDDS_URI"] = CYCLONE  # the only interface there is has no cable: it would not be taken by itself
domains = itertools.count(1)


def pytest_configure(config):
    """Refuses to run where others would hear it."""
    if os.environ.get("ROS2_NETWORK") != "own":
        pytest.exit("these tests want a network of their own: scripts/ros2.sh", returncode=2)


def lacking(what: str):
    """Skips a test for want of something; with ROS2=required it fails."""
    if os.environ.get("ROS2") == "required":
        pytest.fail(f"missing: {what}")
    pytest.skip(f"missing: {what}")


@pytest.fixture
def domain() -> int:
    """A domain that no test before has used: peers that were killed are still listed as alive there."""
    return next(domains)


@pytest.fixture
def cyclone(domain):
    """A participant of Cyclone DDS in the domain."""
    from peers import Cyclone

    peer = Cyclone(domain)
    yield peer
    peer.close()


@pytest.fixture
def fast_dds(domain):
    """Starts participants of Fast DDS in the domain."""
    from peers import FastDds

    if not FastDds.program:
        lacking("Fast DDS (apt install libfastrtps-dev)")
    peers = []

    def start(**settings) -> FastDds:
        peers.append(FastDds(domain, **settings))
        return peers[-1]

    yield start
    for peer in peers:
        peer.close()


@pytest.fixture
def run(domain):
    """Starts runs in the domain, and ends them."""
    from program import Run

    runs = []

    def start(scenario: str, *options: str, **settings) -> Run:
        runs.append(Run(scenario, *options, **{"domain": domain} | settings))
        return runs[-1]

    yield start
    for one in runs:
        one.close()
