//! Mattes as layers of an EXR file: Cryptomatte 1.2 (Psyop).

use super::exr::Layers;
use crate::mattes::{Matte, Mattes, RANKS};
use std::fmt::Write;

/// Adds the layers `CryptoObject` and `CryptoMaterial`, with what programs need to find things in them by name.
pub fn add(layers: &mut Layers, mattes: &Mattes) {
    add_matte(layers, "CryptoObject", &mattes.objects);
    add_matte(layers, "CryptoMaterial", &mattes.materials);
}

fn add_matte(layers: &mut Layers, layer: &str, matte: &Matte) {
    let ids: Vec<u32> = matte.names.iter().map(|name| id(name)).collect();
    for rank in 0..RANKS {
        let of_rank = |value: &dyn Fn(&crate::mattes::Share) -> f32| {
            matte
                .pixels
                .iter()
                .map(|ranks| value(&ranks[rank]))
                .collect()
        };
        // Two ranks for each four channels.
        let (number, [id_channel, share_channel]) = (rank / 2, [["R", "G"], ["B", "A"]][rank % 2]);
        let id_of = |share: &crate::mattes::Share| match share.share {
            0.0 => 0.0,
            _ => f32::from_bits(ids[share.thing as usize]),
        };
        layers.channel(&format!("{layer}{number:02}.{id_channel}"), of_rank(&id_of));
        layers.channel(
            &format!("{layer}{number:02}.{share_channel}"),
            of_rank(&|share| share.share),
        );
    }
    let key = format!("{:08x}", hash(layer));
    let mut attribute = |name: &str, value: String| {
        layers.attribute(&format!("cryptomatte/{}/{name}", &key[..7]), value);
    };
    attribute("name", layer.to_owned());
    attribute("hash", "MurmurHash3_32".to_owned());
    attribute("conversion", "uint32_to_float32".to_owned());
    attribute("manifest", manifest(&matte.names, &ids));
}

/// The bits of the number that stands for a name: its hash, with an exponent that keeps it from being no number, infinite
/// or denormal.
fn id(name: &str) -> u32 {
    let hash = hash(name);
    match hash >> 23 & 255 {
        0 | 255 => hash ^ 1 << 23,
        _ => hash,
    }
}

fn hash(name: &str) -> u32 {
    // Reading a slice does not fail.
    murmur3::murmur3_32(&mut name.as_bytes(), 0).unwrap_or_default()
}

/// The names with their numbers, as JSON in ASCII: texts of EXR files are Latin-1.
fn manifest(names: &[String], ids: &[u32]) -> String {
    let mut text = String::from("{");
    for (i, (name, id)) in names.iter().zip(ids).enumerate() {
        let between = if i == 0 { "" } else { "," };
        let _ = write!(text, "{between}{}:\"{id:08x}\"", serde_json::json!(name));
    }
    text.push('}');
    let mut ascii = String::new();
    for c in text.chars() {
        if c.is_ascii() {
            ascii.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                let _ = write!(ascii, "\\u{unit:04x}");
            }
        }
    }
    ascii
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the specification's test images.
    #[test]
    fn hashes_are_those_of_cryptomatte() {
        assert_eq!(hash("hello"), 0x248b_fa47);
        assert_eq!(hash("hello, world"), 0x149b_bb7f);
        assert_eq!(hash(""), 0);
        // An exponent of zero, which would be denormal.
        assert_eq!(id(""), 1 << 23);
        assert!(f32::from_bits(id("")).is_normal());
    }

    #[test]
    fn manifests_are_ascii() {
        let names = ["a \"b\"".to_owned(), "Würfel 🎲".to_owned()];
        let ids = names.each_ref().map(|name| id(name));
        let text = manifest(&names, &ids);
        assert!(text.is_ascii());
        let back: std::collections::BTreeMap<String, String> = serde_json::from_str(&text).unwrap();
        assert_eq!(back[&names[1]], format!("{:08x}", ids[1]));
        assert_eq!(back.len(), 2);
    }
}
