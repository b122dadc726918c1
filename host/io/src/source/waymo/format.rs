//! What the headers of Parquet contain, as its `parquet.thrift` declares them: the fields of each
//! structure in the order of their numbers, from 1. `Any` is what the decoder ignores, such as
//! encryption.

use self::FieldType::{Any, Boolean, Byte, Bytes, Double, Integer, List, Needed, Struct};

/// Integers of a page's header that are needed.
#[derive(Clone, Copy)]
pub(super) enum HeaderNumber {
    PageType,
    /// Length of the data, in bytes.
    Unpacked,
    /// Length in the file, in bytes.
    Packed,
    /// Of a data page.
    Values,
    /// Of a dictionary.
    Entries,
    /// Of a data page of version 2.
    ValuesV2,
}

impl HeaderNumber {
    /// How many there are.
    pub const COUNT: usize = HeaderNumber::ValuesV2 as usize + 1;
}

/// The type of a field.
pub(super) enum FieldType {
    /// Not known.
    Any,
    Boolean,
    Byte,
    /// Of 16, 32 or 64 bits, all of which are written alike.
    Integer,
    Needed(HeaderNumber),
    Double,
    /// A string too.
    Bytes,
    List(&'static FieldType),
    /// A union too.
    Struct(&'static [FieldType]),
}

/// At the start of each page.
pub(super) const PAGE_HEADER: &[FieldType] = &[
    Needed(HeaderNumber::PageType),
    Needed(HeaderNumber::Unpacked),
    Needed(HeaderNumber::Packed),
    Integer,
    Struct(DATA_PAGE),
    EMPTY,
    Struct(&[Needed(HeaderNumber::Entries), Integer, Boolean]),
    Struct(DATA_PAGE_V2),
];
/// At the end of a file.
pub(super) const FOOTER: &[FieldType] = &[
    Integer,
    List(&Struct(SCHEMA_ELEMENT)),
    Integer,
    List(&Struct(ROW_GROUP)),
    List(&KEY_VALUE),
    Bytes,
    List(&Struct(&[EMPTY, EMPTY, EMPTY])),
];

const EMPTY: FieldType = Struct(&[]);
const KEY_VALUE: FieldType = Struct(&[Bytes, Bytes]);
const DATA_PAGE: &[FieldType] =
    &[Needed(HeaderNumber::Values), Integer, Integer, Integer, STATISTICS];
const DATA_PAGE_V2: &[FieldType] = &[
    Needed(HeaderNumber::ValuesV2),
    Integer,
    Integer,
    Integer,
    Integer,
    Integer,
    Boolean,
    STATISTICS,
];
const STATISTICS: FieldType =
    Struct(&[Bytes, Bytes, Integer, Integer, Bytes, Bytes, Boolean, Boolean, Integer]);
const SCHEMA_ELEMENT: &[FieldType] = &[
    Integer,
    Integer,
    Integer,
    Bytes,
    Integer,
    Integer,
    Integer,
    Integer,
    Integer,
    Struct(LOGICAL_TYPE),
];
const LOGICAL_TYPE: &[FieldType] = &[
    EMPTY,
    EMPTY,
    EMPTY,
    EMPTY,
    Struct(&[Integer, Integer]),
    EMPTY,
    TIME,
    TIME,
    Any,
    Struct(&[Byte, Boolean]),
    EMPTY,
    EMPTY,
    EMPTY,
    EMPTY,
    EMPTY,
    Struct(&[Byte]),
    Struct(&[Bytes]),
    Struct(&[Bytes, Integer]),
    EMPTY,
];
const TIME: FieldType = Struct(&[Boolean, Struct(&[EMPTY, EMPTY, EMPTY])]);
const ROW_GROUP: &[FieldType] = &[
    List(&Struct(COLUMN_CHUNK)),
    Integer,
    Integer,
    List(&Struct(&[Integer, Boolean, Boolean])),
    Integer,
    Integer,
    Integer,
];
const COLUMN_CHUNK: &[FieldType] =
    &[Bytes, Integer, Struct(COLUMN), Integer, Integer, Integer, Integer];
const COLUMN: &[FieldType] = &[
    Integer,
    List(&Integer),
    List(&Bytes),
    Integer,
    Integer,
    Integer,
    Integer,
    List(&KEY_VALUE),
    Integer,
    Integer,
    Integer,
    STATISTICS,
    List(&Struct(&[Integer, Integer, Integer])),
    Integer,
    Integer,
    Struct(&[Integer, List(&Integer), List(&Integer)]),
    Struct(&[Struct(BOUNDING_BOX), List(&Integer)]),
];
const BOUNDING_BOX: &[FieldType] =
    &[Double, Double, Double, Double, Double, Double, Double, Double];
