"""Read-only web page of ``dearig watch``: what a campaign and a running recording do now."""
