"""The list of what makes a machine a probe, in the order in which it is put right."""

from __future__ import annotations

from dataclasses import dataclass

from device.provisioning.accounts import AccountsItem, DeployKeyItem, FoldersItem, SshItem
from device.provisioning.boot_files import BootSettingsItem, KernelLineItem, ReadOnlyBootItem, SwapItem
from device.provisioning.identity import SerialItem, SignersItem, TimeServersItem, TimeZoneItem, require_server_names
from device.provisioning.installation import (
    FirstReleaseItem,
    FittingReleaseItem,
    GoingItem,
    UdevItem,
    other_links,
    unit_links,
)
from device.provisioning.item import ProvisioningItem, TextItem
from device.provisioning.packages import NEEDED, ONLY_RASPBERRY_PI_OS, PackagesItem

JOURNAL = """# Made by provisioning. After a power cut the log is there but for its last minute; it stays small.
[Journal]
Storage=persistent
SystemMaxUse=100M
SyncIntervalSec=1min
"""
WATCHDOG = """# Made by provisioning. A computer that is frozen as a whole starts again by itself.
[Manager]
RuntimeWatchdogSec=1min
RebootWatchdogSec=2min
"""
"""The Pi's own watchdog, which systemd feeds: systemd-system.conf(5). Its timer ends after 15 s, and the kernel feeds
it meanwhile: a kernel that stands still is reset after 15 s, one on which nothing runs any more after a minute.
"""
BROWSER = '{"DownloadRestrictions": 3}\n'
"""The screen's browser saves no file: Chrome Enterprise policies, DownloadRestrictions; read where Debian has it."""
RESTART_JOURNAL = (("systemctl", "restart", "systemd-journald.service"),)


@dataclass(frozen=True)
class ProvisioningWishes:
    """What a probe is to be; an empty word asks only that there is one.

    `release` names a file, `signers` and `deploy_key` are texts. A stand-in is a machine without a Pi's own packages.
    """

    serial: str = ""
    release: str = ""
    signers: str = ""
    deploy_key: str = ""
    time_zone: str = ""
    time_servers: str = ""
    camera_overlay: str = ""
    is_stand_in: bool = False


def plan_of(wishes: ProvisioningWishes) -> list[ProvisioningItem]:
    """Return the items. What wants a reboot comes before the release, which needs its camera to prove itself.

    Raises `ProvisioningFailed` for time servers that are none.
    """
    require_server_names(wishes.time_servers)
    pi_packages = [] if wishes.is_stand_in else [PackagesItem("packages of Raspberry Pi OS", ONLY_RASPBERRY_PI_OS)]
    return [
        FittingReleaseItem(wishes.release),
        SerialItem(wishes.serial),
        SignersItem(wishes.signers),
        PackagesItem("packages", NEEDED),
        *pi_packages,
        AccountsItem(),
        FoldersItem(),
        DeployKeyItem(wishes.deploy_key),
        SshItem(),
        TimeZoneItem(wishes.time_zone),
        TimeServersItem(wishes.time_servers),
        TextItem("journal", "/etc/systemd/journald.conf.d/tsis.conf", JOURNAL, RESTART_JOURNAL),
        TextItem("I2C from user space", "/etc/modules-load.d/tsis.conf", "i2c-dev\n"),
        BootSettingsItem(wishes.camera_overlay),
        KernelLineItem(),
        TextItem("watchdog of the computer", "/etc/systemd/system.conf.d/tsis.conf", WATCHDOG),
        SwapItem(),
        TextItem("screen without downloads", "/etc/chromium/policies/managed/tsis.json", BROWSER),
        ReadOnlyBootItem(),
        UdevItem(),
        other_links(),
        unit_links(),
        FirstReleaseItem(wishes.release),
        GoingItem(),
    ]
