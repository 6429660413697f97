"""One question a file: what is asked, the cells to try, how one cell is run, what is shown, drawn and aimed at."""
