//! Sessions on disk: a finished or interrupted map, to go on with or to draw again.
//!
//! ```text
//! offset 0  4  "HMAP"
//!        4  2  version, little endian
//!        6  8  length of the payload, little endian
//!       14  4  CRC-32 of the payload, little endian
//!       18  …  payload: bincode 2 (little endian, variable integers) of the structs of that version
//! ```
//!
//! The structs of a version are its own and never those of a layer, so that no change of a layer changes a file.
//! Derived things (signatures, the map of walls, the gridmap) are not stored: they are made again from the scans.

pub(crate) mod records;
mod v1;
mod v2;
mod v3;
mod v4;
mod v5;
mod v6;

use std::io::{Read, Write};

use serde::de::DeserializeOwned;

use crate::mapper::{Mapper, MapperError};

const MAGIC: &[u8; 4] = b"HMAP";
const VERSION: u16 = 6;
const HEADER: usize = 18;
/// No session is read that claims to be larger: 4 GiB hold about a million scans of 1,000 beams.
const LIMIT: usize = 4 << 30;

/// Why a session cannot be stored or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The file or stream failed.
    #[error("session: {0}")]
    Io(#[from] std::io::Error),
    /// It does not begin like a session.
    #[error("this is no session: it does not begin with `HMAP`")]
    NoSession,
    /// It was written by a later program.
    #[error("the session is of version {found}, this program reads up to {VERSION}")]
    TooNew {
        /// The file's version.
        found: u16,
    },
    /// It is longer than any session may be.
    #[error("the session claims {claimed} bytes, more than {LIMIT}")]
    TooLarge {
        /// What its header says.
        claimed: u64,
    },
    /// It ends early.
    #[error("the session is cut off: {expected} bytes were announced, {found} are there")]
    CutOff {
        /// What its header says.
        expected: usize,
        /// What there is.
        found: usize,
    },
    /// Its bytes have changed since they were written.
    #[error("the session is damaged: its checksum is {found:08x}, {expected:08x} was written")]
    Damaged {
        /// The stored checksum.
        expected: u32,
        /// The checksum of what is there.
        found: u32,
    },
    /// Its bytes are whole and make no sense.
    #[error("the session cannot be decoded: {0}")]
    Decode(String),
    /// Its numbers contradict each other.
    #[error("the session contradicts itself: {0}")]
    Contradiction(String),
    /// The map in it cannot be built.
    #[error("the session's map cannot be restored: {0}")]
    Map(#[from] MapperError),
}

impl Mapper {
    /// Stores everything that cannot be made again.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    ///
    /// # Panics
    ///
    /// Never: plain structs of numbers always encode.
    pub fn save(&self, out: &mut impl Write) -> Result<(), SessionError> {
        let session = if self.trajectory().samples().is_empty() {
            v6::Session::of(&Self::new(self.config().clone())?) // what waits for a first scan is read once more
        } else {
            v6::Session::of(self)
        };
        let payload =
            bincode::serde::encode_to_vec(session, configuration()).expect("plain structs of numbers always encode");
        out.write_all(MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&(payload.len() as u64).to_le_bytes())?;
        out.write_all(&crc32fast::hash(&payload).to_le_bytes())?;
        out.write_all(&payload)?;
        Ok(out.flush()?)
    }

    /// Reads a stored map, to go on with it.
    ///
    /// # Errors
    ///
    /// A stream that is no session, of a later version, cut off, damaged, or in contradiction with itself.
    pub fn load(from: &mut impl Read) -> Result<Self, SessionError> {
        let (version, payload) = payload(from)?;
        let session = match version {
            1 => v5::Session::from(v3::Session::from(v2::Session::from(decode::<v1::Session>(&payload)?))).into(),
            2 => v5::Session::from(v3::Session::from(decode::<v2::Session>(&payload)?)).into(),
            3 => v5::Session::from(decode::<v3::Session>(&payload)?).into(),
            4 => v5::Session::from(decode::<v4::Session>(&payload)?).into(),
            5 => decode::<v5::Session>(&payload)?.into(),
            _ => decode::<v6::Session>(&payload)?,
        };
        session.restore()
    }
}

/// Decodes all of a payload as the structs of one version.
fn decode<S: DeserializeOwned>(payload: &[u8]) -> Result<S, SessionError> {
    let (session, used) = bincode::serde::decode_from_slice(payload, configuration())
        .map_err(|error| SessionError::Decode(error.to_string()))?;
    if used != payload.len() {
        return Err(SessionError::Decode(format!("{} bytes follow its end", payload.len() - used)));
    }
    Ok(session)
}

/// Checks the header and reads what it announces: the version and the payload.
fn payload(from: &mut impl Read) -> Result<(u16, Vec<u8>), SessionError> {
    let mut header = Vec::with_capacity(HEADER);
    from.take(HEADER as u64).read_to_end(&mut header)?;
    if !header.starts_with(MAGIC) {
        return Err(SessionError::NoSession);
    }
    let Ok(header): Result<[u8; HEADER], _> = header.try_into() else {
        return Err(SessionError::CutOff { expected: HEADER, found: 0 });
    };
    let field = |at: usize| &header[at..];
    let version = u16::from_le_bytes([field(4)[0], field(4)[1]]);
    if version > VERSION {
        return Err(SessionError::TooNew { found: version });
    }
    let mut length = [0; 8];
    length.copy_from_slice(&header[6..14]);
    let claimed = u64::from_le_bytes(length);
    let expected = usize::try_from(claimed).ok().filter(|length| *length <= LIMIT);
    let Some(expected) = expected else { return Err(SessionError::TooLarge { claimed }) };
    let mut payload = Vec::new();
    from.take(claimed).read_to_end(&mut payload)?;
    if payload.len() != expected {
        return Err(SessionError::CutOff { expected, found: payload.len() });
    }
    let stored = u32::from_le_bytes([header[14], header[15], header[16], header[17]]);
    let found = crc32fast::hash(&payload);
    if found == stored { Ok((version, payload)) } else { Err(SessionError::Damaged { expected: stored, found }) }
}

fn configuration() -> impl bincode::config::Config {
    bincode::config::standard().with_little_endian().with_variable_int_encoding().with_limit::<LIMIT>()
}
