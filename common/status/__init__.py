"""What a side says of itself: codes and figures in one struct a side. Words for them are made where people read."""
