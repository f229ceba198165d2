"""`python -m device tokens`: which other machines have a token, and an end for one of them."""

from __future__ import annotations

import argparse
import json

from device.access.scopes import TOKENS
from device.commands.pair import ask
from device.config import Config
from device.files.text_table import aligned

EXAMPLES = """examples:
  python -m device tokens                    who has a token, what for and until when
  python -m device tokens --revoke ID        it holds no more, and its streams end
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add which token is to be revoked."""
    parser.epilog = EXAMPLES
    parser.add_argument("--revoke", metavar="ID", help="let this one hold no more")
    parser.add_argument("--json", action="store_true", help="print a JSON object")


def run(options: argparse.Namespace, config: Config) -> int:
    """List the tokens, or revoke one."""
    if options.revoke:
        revoked = ask(config, "DELETE", f"{TOKENS}/{options.revoke}")
        print(json.dumps(revoked) if options.json else f"The token of {revoked['name']} holds no more.")
        return 0
    found = ask(config, "GET", TOKENS)
    if options.json:
        print(json.dumps(found))
    elif not found["tokens"]:
        print("No other machine has a token.")
    else:
        names = "id", "name", "scope", "expires_at", "revoked_at"
        rows = [tuple(str(one[name] or "") for name in names) for one in found["tokens"]]
        print("\n".join(aligned([("id", "name", "may", "until", "revoked"), *rows])))
    return 0
