"""Control of how much a side sends, and in which order, so that its messages cause no queue in the link."""
