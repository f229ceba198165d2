import json
from pathlib import Path

import pytest
from small_wheels import small_wheel

from device.measurement.quantities import InvalidQuantity
from host_tools.release.checkout import Checkout
from host_tools.release.parts_list import parts_list
from host_tools.release.target import Target

CHECKOUT = Checkout(Path(), "0123456789abcdef", 1_700_000_000, ())
ARM = Target.named("aarch64")
NEEDS = (
    "Requires-Dist: part>=2\nRequires-Dist: plotter; extra == 'host'\nRequires-Dist: clock; sys_platform == 'win32'\n"
)


def listed(own, *others):
    return json.loads(parts_list(own, others, CHECKOUT, ARM))


def test_each_wheel_is_a_component_with_licence_hash_and_needs(tmp_path):
    own = small_wheel(tmp_path, "tsis", metadata="License-Expression: Apache-2.0\n" + NEEDS)
    classified = "Classifier: License :: OSI Approved :: BSD License\nLicense: " + "a long text " * 10 + "\n"
    found = listed(own, small_wheel(tmp_path, "part", "2.1", metadata=classified))
    assert (found["bomFormat"], found["specVersion"]) == ("CycloneDX", "1.6")
    product, (part,) = found["metadata"]["component"], found["components"]
    assert (product["name"], product["type"], product["version"]) == ("tsis", "application", "1.0")
    assert product["licenses"] == [{"license": {"id": "Apache-2.0"}}]
    assert part["licenses"] == [{"license": {"name": "BSD License"}}]
    assert part["purl"] == "pkg:pypi/part@2.1?file_name=part-2.1-py3-none-any.whl"
    assert [each["alg"] for each in part["hashes"]] == ["SHA-256"]
    assert {"ref": "tsis@1.0", "dependsOn": ["part@2.1"]} in found["dependencies"]


def test_it_has_the_commits_time_and_no_chance_in_it(tmp_path):
    own, part = small_wheel(tmp_path, "tsis", metadata=NEEDS), small_wheel(tmp_path, "part", "2.1")
    assert parts_list(own, [part], CHECKOUT, ARM) == parts_list(own, [part], CHECKOUT, ARM)
    assert listed(own, part)["metadata"]["timestamp"] == "2023-11-14T22:13:20+00:00"


@pytest.mark.parametrize("others", [[], [("part", "1.9")]], ids=["missing", "too old"])
def test_a_need_that_no_wheel_meets_is_refused(tmp_path, others):
    own = small_wheel(tmp_path, "tsis", metadata=NEEDS)
    with pytest.raises(InvalidQuantity, match="part for tsis is .*, but must be part>=2: run `make lock`"):
        listed(own, *(small_wheel(tmp_path, *other) for other in others))
