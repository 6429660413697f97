"""Status of each side: codes and figures in one struct a side. Words are made where people read them."""
