"""Files and folders of users: where they are, and how they are read and written safely."""
