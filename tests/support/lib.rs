//! Shared by the tests of raywake.
