"""Results for programs: JSON documents with their schemas, and motions for controllers."""
