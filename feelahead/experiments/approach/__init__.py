"""`feelahead try approach`: does a finger of constant force hit what is ahead?"""
