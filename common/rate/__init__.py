"""Amount and order of a side's messages, so that they cause no queue in the link."""
