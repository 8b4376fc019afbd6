"""Which public data there are: where they lie in a data folder, whose they are, on what terms, and their digests."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Dataset", "RemoteFile", "registry"]

_RAW = "https://raw.githubusercontent.com"


@dataclass(frozen=True)
class RemoteFile:
    """A file that can be downloaded as it is.

    Parameters
    ----------
    path : str
        Where it goes, within the data set's folder.
    url : str
        Where it is, at a pinned revision.
    sha256 : str
        Digest of the file as it is kept (after unpacking).
    unpack : bool
        Whether it comes compressed by gzip and is kept plain.
    """

    path: str
    url: str
    sha256: str
    unpack: bool = False


@dataclass(frozen=True)
class Dataset:
    """A folder of public data.

    Parameters
    ----------
    name : str
        The folder, within the data folder.
    title : str
        What it holds.
    source : str
        Where it comes from, with the revision.
    terms : str
        On what terms it may be used.
    citation : str
        What to cite.
    files, size : int
        Number of files, and their bytes together.
    sha256 : str
        Digest over all files: of the sorted lines ``digest  path``.
    remote : tuple of RemoteFile
        Files that :func:`pliant.datasets.fetch` can download. The rest must be made from the source as
        ``preparation`` says.
    preparation : str
        What was done to the source's files, where they are not kept as they are.
    """

    name: str
    title: str
    source: str
    terms: str
    citation: str
    files: int
    size: int
    sha256: str
    remote: tuple[RemoteFile, ...] = ()
    preparation: str = ""


def _slam(name: str, digest: str, folder: str = "examples/data/") -> RemoteFile:
    revision = "501ae4144e28a47803da04eced5786f7bc25b609"
    return RemoteFile(name, f"{_RAW}/brain-slam/slam/{revision}/{folder}{name}", digest)


def _pycortex(name: str, digest: str, folder: str = "filestore/db/S1/surfaces/") -> RemoteFile:
    revision = "e32cac2ca013002ba0b94cd9fd18a153f7eb2690"
    return RemoteFile(name, f"{_RAW}/gallantlab/pycortex/{revision}/{folder}{name}", digest)


def _freesurfer(
    name: str, revision: str, digest: str, *, remote: str = "", unpack: bool = False
) -> RemoteFile:
    url = f"{_RAW}/dfsp-spirit/freesurferformats/{revision}/inst/extdata/{remote or name}"
    return RemoteFile(name, url, digest, unpack)


def _total(name: str, path: str, digest: str) -> RemoteFile:
    revision = "0e65a448d557382b1e925276212b3bec7f5aff83"
    return RemoteFile(
        name, f"{_RAW}/wasserth/TotalSegmentator/{revision}/tests/reference_files/{path}", digest
    )


def _cardiomesh(name: str, digest: str) -> RemoteFile:
    revision = "9802b342bd088d4b92583ea4f37e949d5ebc4ec0"
    return RemoteFile(name, f"{_RAW}/rbonazzola/CardioMesh/{revision}/data/{name}", digest)


_REGISTRY = (
    Dataset(
        "shapes/tosca",
        "TOSCA high resolution: cats, dogs, horses, wolves, one woman, in poses of one triangulation",
        "tosca.cs.technion.ac.il, TOSCA high-resolution; symmetry from "
        "llorz/SGA18_orientation_BCICP_dataset @ 28bd966",
        "academic use, cite",
        "Bronstein, Bronstein & Kimmel 2008, Numerical Geometry of Non-Rigid Shapes; Ren et al. 2018",
        43,
        38439812,
        "12182d8b36981c451f67768232e1bd9f3ead1eff11afbd3f40c17810608796db",
        preparation="converted to binary PLY, all poses with the faces of pose 0",
    ),
    Dataset(
        "shapes/tosca_remeshed_5k",
        "TOSCA remeshed to about 5,000 vertices, with corresponding points and symmetry",
        "llorz/SGA18_orientation_BCICP_dataset @ 28bd96639e185ae78b970b0a74b0145a1f5cbbfd",
        "academic use, cite",
        "Ren, Poulenard, Wonka & Ovsjanikov 2018, Continuous and orientation-preserving correspondences",
        93,
        7278080,
        "0ee762f804bb2da30063db049a38cb7574a2cc34affec9734226b37b49a9b531",
        preparation="converted to PLY",
    ),
    Dataset(
        "shapes/kids",
        "Three poses of one child, 59,727 vertices, with an exact symmetry",
        "Rodola et al. 2014, KIDS data set",
        "academic use, cite",
        "Rodola, Rota Bulo, Windheuser, Vestner & Cremers 2014, Dense non-rigid shape correspondence using "
        "random forests",
        4,
        7760755,
        "aa04ace451fb56576b9c06e4b53805802610388902ae41cd6ec666926cfe2042",
        preparation="converted to PLY",
    ),
    Dataset(
        "shapes/non_rigid_world",
        "Small meshes of animals, many of them broken",
        "tosca.cs.technion.ac.il, non-rigid world",
        "academic use, cite",
        "Bronstein, Bronstein & Kimmel 2008, Numerical Geometry of Non-Rigid Shapes",
        10,
        2160567,
        "6f6d5213ab6e0cbcf1c571b2713f4a917cb6d3cd8f0d18b29fbfadb533d62d50",
        preparation="converted to OBJ",
    ),
    Dataset(
        "cortex/subject1",
        "One native FreeSurfer hemisphere with thickness and parcellation, 149,244 vertices",
        "dfsp-spirit/freesurferformats, at the revisions of each file",
        "MIT",
        "Schaefer, freesurferformats",
        3,
        6335684,
        "bd3f4401c82c9cec240458b406df83c233698a80bfa18b5dcb401cd8a5ba467d",
        (
            _freesurfer(
                "lh.white",
                "3b503058c0ae5b7be2d0ef5b1ab386a2ecc94fe1",
                "6e37333a0ddbb2297fd77f35fa10ac313dcf0f3d3c90ff67ab3c910520d2a6cb",
                remote="lh.white.gz",
                unpack=True,
            ),
            _freesurfer(
                "lh.thickness",
                "234e1ea63ff0f90bd9f8abecd44d5212cfadcc6a",
                "681d6033ae47897ca184e5748b538395bbb8aa62fb3bdad5578a7470e5b716f1",
            ),
            _freesurfer(
                "lh.aparc.annot.gz",
                "3f97ba8ff6f20518125bc6bab777b244d5ea1051",
                "f097bb64e235f3f2c337e81b358dceb5d1b0a2646a65e622f1a678e462b7387c",
            ),
        ),
    ),
    Dataset(
        "cortex/pycortex_S1",
        "White and pial surface of one brain with common vertices, 152,893",
        "gallantlab/pycortex @ e32cac2ca013002ba0b94cd9fd18a153f7eb2690",
        "BSD-2-Clause",
        "Gao, Huth, Lescroart & Gallant 2015, Pycortex: an interactive surface visualizer for fMRI",
        3,
        7606350,
        "f0e32ae7c80f4b298a5996a429a2fe8dae088917485f2484907ea6003254f0e5",
        (
            _pycortex("wm_lh.gii", "194da2de9a0617314d34b791f5476e2789b62329a9a2d4f020346a76ae3fe936"),
            _pycortex("pia_lh.gii", "63cd7317ed7be61ac632fa8f1b80a0272601f9b22ad7bf954116138496d23d57"),
            _pycortex("LICENSE", "418163499f05a6d9504ef8a7c79a54000f65c6872735d6d8d3ccae32a9879057", ""),
        ),
    ),
    Dataset(
        "cortex/slam",
        "A small cortical mesh with a depth-potential texture",
        "brain-slam/slam @ 501ae4144e28a47803da04eced5786f7bc25b609",
        "MIT",
        "Lefevre et al., slam: surface analysis and modelling",
        4,
        87517,
        "d2782c615c56b273d65ae44a5f946ed86f30f48af6e3c1c196bca0146b0bb5e5",
        (
            _slam("example_mesh.gii", "c375300483756bb890391a86a59e582461d2e31e360eadafae5e6b4f1015cdae"),
            _slam("example_dpf.gii", "348333dd35c515c61b9928898917f00ce4ce7b55497a8043c0e982a6e08a2e0b"),
            _slam("example_texture.gii", "ae31f7c50365891c844ebf545ecf69783ee9022491e279198656168083b8b19a"),
            _slam("LICENSE", "4e704d15b4dec2bd9ee824112cdfa23b69ee498a564ab38b977654cf4dd99344", ""),
        ),
    ),
    Dataset(
        "heart/ct",
        "Two crops of one contrast CT with a heart mask and a rough blood pool",
        "wasserth/TotalSegmentator @ 0e65a448d557382b1e925276212b3bec7f5aff83, tests",
        "Apache-2.0",
        "Wasserthal et al. 2023, TotalSegmentator",
        5,
        6162600,
        "f6e1cb80a5c96b49e5a7579295c10dc16640fd6de61df23cf07b458a6c687a25",
        (
            _total(
                "ct_pulm_cropped.nii.gz",
                "pulmonary_report/models/ct_cropped.nii.gz",
                "4da078fe43c9aa4d358903ac95105cea4fbe93b029474e4701bdde4db72126eb",
            ),
            _total(
                "ct_aorta_cropped.nii.gz",
                "aorta_report/test_result/models/ct_cropped.nii.gz",
                "f776ecfa1326e7e21a8c30e5530f517c16f16a59a68fc06e8119cefc7c3b87a0",
            ),
            _total(
                "pulmonary_report__models__heart.nii.gz",
                "pulmonary_report/models/heart.nii.gz",
                "3c3eaf9e029e07aa3248e8d9973103b3168f35cc37756867bcb47b507cad288a",
            ),
        ),
        preparation="the blood pool is a watershed of the CT, checked by eye only",
    ),
    Dataset(
        "heart/sunnybrook",
        "45 hearts, short-axis MR: outlines, groups and cavity meshes",
        "Sunnybrook Cardiac Data, cardiac atlas project",
        "public domain",
        "Radau et al. 2009, Evaluation framework for algorithms segmenting short axis cardiac MRI",
        48,
        20590857,
        "116e4def1314f76e60259a4bb5f67c6605cb800546636caca78bebc56434d679",
        preparation="outlines as masks of 64 x 64, cavities as watertight meshes",
    ),
    Dataset(
        "heart/aha",
        "A left ventricle with an AHA segment at every vertex",
        "rbonazzola/CardioMesh @ 9802b342bd088d4b92583ea4f37e949d5ebc4ec0",
        "MIT",
        "Bonazzola, CardioMesh",
        2,
        915022,
        "6606668a69632f97ac57f47d7a9a49ad196101cefebcdf55874f30e03fd94d64",
        (
            _cardiomesh(
                "LV_4396_vertices_with_aha_segments.vtk",
                "39ac32ea72fc9e2535afe21308fe97fbd9f0fdd0f6b06ed45161f6cae3de0a4a",
            ),
            _cardiomesh(
                "LV_4396_vertices_with_epi_endo.vtk",
                "0ab1b18014abf688f19e417a19277756d4d8020bdca9e93e7b4824b23af3a771",
            ),
        ),
    ),
    Dataset(
        "images/symd",
        "24 pairs of historic and modern pictures with hand-drawn boxes",
        "chaitanya100100/Spectral-Analysis-for-Image-Matching @ ce2d17613f2453c5191591f6b803250e7b770660",
        "no licence stated: research use only, no redistribution",
        "Hauagge & Snavely 2012, Image matching using local symmetry features",
        60,
        4944052,
        "daee1b5f37f79cad629c70f67cf4be42feeac7c433c2b93b433aef30b61bc5b3",
        preparation="at most 640 px, boxes and masks drawn by hand",
    ),
    Dataset(
        "images/caltech101",
        "40 categories of Caltech-101, 2,261 pictures",
        "MachineLearning2020/Homework2-Caltech101 @ 836044dd000296b2bb74d0aa4b4e462e459b01d7",
        "no licence stated (CaltechDATA: CC BY 4.0): research use only",
        "Fei-Fei, Fergus & Perona 2004, Learning generative visual models from few training examples",
        2262,
        34733260,
        "95ff1494116113c9cf0d8c5bb84d2b5ca8960d8a50a0e8c8ce68a7a91de02455",
        preparation="at most 60 pictures a category, 240 px",
    ),
    Dataset(
        "images/pacs",
        "Photographs, paintings, cartoons and sketches of seven classes, 700 pictures",
        "MachineLearning2020/Homework3-PACS @ d586a6cf3db84896fb6cc465c7bf51bdaf6d65d8",
        "no licence stated: research use only",
        "Li, Yang, Song & Hospedales 2017, Deeper, broader and artier domain generalization",
        701,
        10281250,
        "5cc7bd4cf12ca3b59a985b6e2194c0729e02d8f7a7d78d7951eb592ab3a918be",
        preparation="25 pictures a class and domain",
    ),
)


def registry() -> tuple[Dataset, ...]:
    """Return what is known of public data; nothing is read or downloaded.

    Returns
    -------
    tuple of Dataset

    Examples
    --------
    >>> [dataset.name for dataset in registry() if dataset.remote]
    ['cortex/subject1', 'cortex/pycortex_S1', 'cortex/slam', 'heart/ct', 'heart/aha']
    """
    return _REGISTRY
