"""Entry point of ``python -m fibrefit``."""

from __future__ import annotations

from fibrefit.cli.main import main

if __name__ == "__main__":
    main()
