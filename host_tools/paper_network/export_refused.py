"""Why a network was not exported; apart from the export, for who tells the refusal need not load ONNX."""


class ExportRefused(ValueError):  # noqa: N818 - reads as what it says: this export was refused
    """The exported network does not compute what the trained one does; nothing was written."""
