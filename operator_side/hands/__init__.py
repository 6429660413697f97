"""What the person wants: travel, sticks and buttons become an intent."""
