"""Rows as the tables of other packages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas
    import polars


class Tabular:
    """What is a table: pandas, polars, and through Arrow's C stream pyarrow and DuckDB take it as it is."""

    def to_pandas(self) -> pandas.DataFrame:
        """Its rows, which the class describes, as a pandas ``DataFrame``."""
        import pandas

        return pandas.DataFrame(self._rows())

    def to_polars(self) -> polars.DataFrame:
        """The same as a polars ``DataFrame``."""
        import polars

        return polars.DataFrame(self._rows())

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        import pyarrow

        return pyarrow.Table.from_pylist(self._rows()).__arrow_c_stream__(requested_schema)

    def _rows(self) -> list[dict[str, Any]]:
        raise NotImplementedError
