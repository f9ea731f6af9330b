"""The command line as ``python -m turing_learning``."""

from turing_learning.cli import main

if __name__ == "__main__":
    main()
