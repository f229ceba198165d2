"""The parts list of a release (CycloneDX 1.6): every wheel with its version, licence and hash, and what it needs.

It is read from the wheels themselves. A need that no wheel of the release meets is refused: on a probe, where files are
only unpacked, pip is not asked.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from packaging.metadata import RawMetadata, parse_email
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from device.measurement.quantities import InvalidQuantity
from host_tools.release.checkout import Checkout
from host_tools.release.locked_wheels import sha256_of
from host_tools.release.target import Target

MOST_LICENSE_CHARACTERS = 60
"""A longer text is the licence itself, not its name."""


@dataclass(frozen=True)
class DescribedWheel:
    """A wheel and what its METADATA says of it."""

    path: Path
    metadata: RawMetadata

    @classmethod
    def of(cls, path: Path) -> DescribedWheel:
        """Read a wheel; raise `InvalidQuantity` for one without METADATA."""
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                if name.count("/") == 1 and name.endswith(".dist-info/METADATA"):
                    return cls(path, parse_email(archive.read(name))[0])
        raise InvalidQuantity("wheel", path.name, "one with METADATA", "download it again")

    @property
    def name(self) -> str:
        """Its name in the one spelling that can be compared."""
        return canonicalize_name(self.metadata["name"])

    def needs(self, target: Target) -> list[Requirement]:
        """Return what it needs on a target, without its extras."""
        stated = map(Requirement, self.metadata.get("requires_dist", []))
        here = target.markers() | {"extra": ""}
        return [one for one in stated if one.marker is None or one.marker.evaluate(here)]

    def license_name(self) -> str:
        """Return its licence by name, or nothing where it does not say."""
        stated = self.metadata.get("license_expression") or self.metadata.get("license", "")
        if 0 < len(stated) <= MOST_LICENSE_CHARACTERS:
            return stated
        classified = [one for one in self.metadata.get("classifiers", []) if one.startswith("License ::")]
        return classified[0].split(" :: ")[-1] if classified else ""


def parts_list(own: Path, others: Sequence[Path], checkout: Checkout, target: Target) -> bytes:
    """Return the parts list as JSON: `own` is the product, the `others` its parts.

    Raises `InvalidQuantity` where a wheel needs what is not there.
    """
    wheels = {wheel.name: wheel for wheel in map(DescribedWheel.of, [own, *others])}
    product = DescribedWheel.of(own).name
    parts = {name: _component(wheel, is_product=name == product) for name, wheel in wheels.items()}
    origin = f"{checkout.commit}/{parts[product].version}/{target.machine}"
    bom = Bom(
        components=[part for name, part in parts.items() if name != product],
        serial_number=uuid5(NAMESPACE_URL, f"tsis/{origin}"),
        metadata=BomMetaData(component=parts[product], timestamp=datetime.fromtimestamp(checkout.time_s, UTC)),
    )
    for name, wheel in wheels.items():
        bom.register_dependency(parts[name], [parts[need] for need in _met_needs(wheel, wheels, target)])
    written = make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=1)
    from cyclonedx.validation.json import JsonStrictValidator  # compiles its grammars for a second when imported

    wrong = JsonStrictValidator(SchemaVersion.V1_6).validate_str(written)
    assert wrong is None, wrong
    return written.encode() + b"\n"


def _component(wheel: DescribedWheel, *, is_product: bool) -> Component:
    version, stated = wheel.metadata["version"], wheel.license_name()
    license_ = LicenseFactory().make_from_string(stated) if stated else None
    return Component(
        name=wheel.metadata["name"],
        type=ComponentType.APPLICATION if is_product else ComponentType.LIBRARY,
        version=version,
        description=wheel.metadata.get("summary"),
        bom_ref=f"{wheel.name}@{version}",
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=sha256_of(wheel.path))],
        licenses=[license_] if license_ else [],
        purl=PackageURL("generic" if is_product else "pypi", None, wheel.name, version, {"file_name": wheel.path.name}),
    )


def _met_needs(wheel: DescribedWheel, wheels: Mapping[str, DescribedWheel], target: Target) -> list[str]:
    """Return the names of the wheels that one needs."""
    met = []
    for need in wheel.needs(target):
        found = wheels.get(canonicalize_name(need.name))
        if found is None or not need.specifier.contains(found.metadata["version"], prereleases=True):
            there = found.metadata["version"] if found else "nothing"
            raise InvalidQuantity(f"{need.name} for {wheel.name}", there, str(need), "run `make lock`")
        met.append(found.name)
    return sorted(set(met))
