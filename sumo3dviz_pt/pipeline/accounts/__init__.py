"""What a picture was made from: keys, accounts, digests."""
