"""Import contracts that speak of whole packages: what a room may import, who may import a library, who needs none.

import-linter's own "forbidden" wants a list of what is forbidden, and a module that is new is on no such list. Used by
`lint-imports` through pyproject.toml; `tests/test_import_contracts.py` breaks each contract once.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output

Import = tuple[str, str]


def is_within(module: str, packages: Iterable[str]) -> bool:
    """Return whether a module is one of some packages, or lies in one."""
    return any(module == package or module.startswith(f"{package}.") for package in packages)


class _Directly(Contract):
    """A contract on direct imports; `broken` yields those that are against it."""

    def broken(self, graph: ImportGraph) -> Iterator[Import]:
        raise NotImplementedError

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        found = sorted(self.broken(graph))
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        for importer, imported in check.metadata["found"]:
            output.print_error(f"{importer} imports {imported}.")


class OnlyContract(_Directly):
    """`room` imports, of this project, nothing but itself and the packages of `may_import`.

    A name in `exactly` stands for that one module and nothing in it: such as the package that has the version.
    """

    type_name = "only"
    room = fields.StringField()
    may_import = fields.SetField(subfield=fields.StringField(), required=False)
    exactly = fields.SetField(subfield=fields.StringField(), required=False)

    def broken(self, graph: ImportGraph) -> Iterator[Import]:
        allowed = {self.room, *(self.may_import or ())}
        for module in graph.modules:
            if not is_within(module, [self.room]):
                continue
            for imported in graph.find_modules_directly_imported_by(module):
                ours = is_within(imported, ("device", "host_tools"))
                if ours and not is_within(imported, allowed) and imported not in (self.exactly or ()):
                    yield module, imported


class ReservedContract(_Directly):
    """`libraries` are imported by modules of `rooms` alone."""

    type_name = "reserved"
    rooms = fields.SetField(subfield=fields.StringField())
    libraries = fields.SetField(subfield=fields.StringField())

    def broken(self, graph: ImportGraph) -> Iterator[Import]:
        for library in self.libraries & graph.modules:
            for importer in graph.find_modules_that_directly_import(library):
                if not is_within(importer, self.rooms):
                    yield importer, library


class StandardLibraryContract(_Directly):
    """`room`, and all of ours that it imports, needs nothing but the standard library.

    A package's own `__init__` counts as imported by whoever imports a module in it.
    """

    type_name = "standard_library"
    room = fields.StringField()

    def broken(self, graph: ImportGraph) -> Iterator[Import]:
        needed = [module for module in graph.modules if is_within(module, [self.room])]
        seen: set[str] = set()
        while needed:
            module = needed.pop()
            if module in seen:
                continue
            seen.add(module)
            needed += [".".join(module.split(".")[:depth]) for depth in range(1, module.count(".") + 1)]
            for imported in graph.find_modules_directly_imported_by(module):
                if is_within(imported, ("device", "host_tools")):
                    needed.append(imported)
                elif imported.split(".")[0] not in sys.stdlib_module_names:
                    yield module, imported
