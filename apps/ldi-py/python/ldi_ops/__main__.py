"""`python -m ldi_ops` runs the command line."""

from ._main import main

if __name__ == "__main__":
    main()
